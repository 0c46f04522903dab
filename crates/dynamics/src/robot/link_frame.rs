//! Named frames on the last link, in which people give and read loads.

/// Length below which a coordinate of a rotated point is rounding \[m\].
const ROUNDING_M: f64 = 1e-12;

/// Frame that is fixed to the last link, such as that of a URDF's link.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedFrame {
    /// Name of the URDF's link, or `link_6` for the link frame of a robot file.
    pub name: String,
    /// Its origin in the frame of the last link \[m\].
    pub origin_m: [f64; 3],
    /// Its x, y and z axes in the frame of the last link.
    pub axes: [[f64; 3]; 3],
}

/// Reason why a frame is not found. Name one of the available frames.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no frame `{name}` is fixed to the last link; these are: {}", available.join(" "))]
pub struct NoSuchFrame {
    /// Requested name.
    pub name: String,
    /// Names of the frames on the last link.
    pub available: Vec<String>,
}

impl NamedFrame {
    /// Returns the frame of the last link itself, under a name.
    pub(super) fn identity(name: String) -> Self {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Self { name, origin_m: [0.0; 3], axes }
    }

    /// Returns true if it is the frame with which the model computes.
    pub fn is_model_frame(&self) -> bool {
        *self == Self::identity(self.name.clone())
    }

    /// Converts a point of this frame to the frame of the last link \[m\].
    pub fn point_in_link(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = self.axes;
        core::array::from_fn(|k| {
            without_rounding(self.origin_m[k] + (a[k] * x + b[k] * y + c[k] * z))
        })
    }

    /// Converts a point of the frame of the last link to this frame \[m\].
    pub fn point_in_frame(&self, point: [f64; 3]) -> [f64; 3] {
        self.inverse().point_in_link(point)
    }

    /// Returns the frame of the last link in this frame.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let axes = core::array::from_fn(|k| self.axes.map(|axis| axis[k]));
        let origin_m = self.axes.map(|axis| -dot(axis, self.origin_m));
        Self { name: self.name.clone(), origin_m, axes }
    }

    /// Converts the ten parameters of a body from this frame to the frame of the last link, in the
    /// order of [`ParameterKind::LINK`](super::ParameterKind::LINK). Inertia is about the origin of
    /// each frame. The conversion is linear.
    pub fn parameters_in_link(&self, parameters: [f64; 10]) -> [f64; 10] {
        let [xx, xy, xz, yy, yz, zz, mx, my, mz, mass] = parameters;
        // Second moments Σ = ½ tr(J) 1 − J.
        let half_trace = 0.5 * (xx + yy + zz);
        let second =
            [[half_trace - xx, -xy, -xz], [-xy, half_trace - yy, -yz], [-xz, -yz, half_trace - zz]];
        // Σ' = R Σ Rᵀ + R h pᵀ + p (R h)ᵀ + m p pᵀ and h' = R h + m p.
        let p = self.origin_m;
        let first: [f64; 3] =
            core::array::from_fn(|i| dot(self.axes.map(|axis| axis[i]), [mx, my, mz]));
        let row = |i: usize| self.axes.map(|axis| axis[i]);
        let rotated = |i: usize, j: usize| dot(row(i), second.map(|line| dot(line, row(j))));
        let shifted = |i: usize, j: usize| {
            rotated(i, j) + first[i] * p[j] + p[i] * first[j] + mass * p[i] * p[j]
        };
        let trace = shifted(0, 0) + shifted(1, 1) + shifted(2, 2);
        let [hx, hy, hz] = core::array::from_fn(|i| first[i] + mass * p[i]);
        [
            trace - shifted(0, 0),
            -shifted(0, 1),
            -shifted(0, 2),
            trace - shifted(1, 1),
            -shifted(1, 2),
            trace - shifted(2, 2),
            hx,
            hy,
            hz,
            mass,
        ]
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn without_rounding(length_m: f64) -> f64 {
    if length_m.abs() < ROUNDING_M { 0.0 } else { length_m }
}
