//! Where the frames of the links are.

use super::{Joint, JointKind, Robot};

/// The frame of a link in that of the base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkFrame {
    /// Its origin \[m\].
    pub origin_m: [f64; 3],
    /// Its x, y and z; z is the joint's axis.
    pub axes: [[f64; 3]; 3],
}

impl LinkFrame {
    const BASE: Self =
        Self { origin_m: [0.0; 3], axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] };

    /// Turned about its x or z (0 or 2), counted by cosine and sine.
    fn turned(mut self, about: usize, cos: f64, sin: f64) -> Self {
        let [first, second] = [(about + 1) % 3, (about + 2) % 3];
        for k in 0..3 {
            let [a, b] = [self.axes[first][k], self.axes[second][k]];
            self.axes[first][k] = cos * a + sin * b;
            self.axes[second][k] = cos * b - sin * a;
        }
        self
    }

    fn moved(mut self, along: usize, by_m: f64) -> Self {
        for (origin, axis) in self.origin_m.iter_mut().zip(self.axes[along]) {
            *origin += by_m * axis;
        }
        self
    }

    /// That of the next link: RotX(α) · TransX(d) · RotZ(θ) · TransZ(r).
    fn next(self, joint: &Joint, q: f64) -> Self {
        let Joint { kind, alpha, d_m, theta, r_m, .. } = joint;
        let (sin, cos) = if *kind == JointKind::Revolute { q.sin_cos() } else { (0.0, 1.0) };
        let r = r_m + if *kind == JointKind::Prismatic { q } else { 0.0 };
        self.turned(0, alpha.cos, alpha.sin)
            .moved(0, *d_m)
            .turned(2, theta.cos, theta.sin)
            .turned(2, cos, sin)
            .moved(2, r)
    }
}

impl Robot {
    /// The frames of all links at joint positions \[rad or m\], from the first; those that are not given are 0.
    pub fn frames(&self, q: &[f64]) -> Vec<LinkFrame> {
        let mut frame = LinkFrame::BASE;
        let of = |(index, joint): (usize, &Joint)| {
            frame = frame.next(joint, q.get(index).copied().unwrap_or(0.0));
            frame
        };
        self.chain().iter().enumerate().map(of).collect()
    }
}
