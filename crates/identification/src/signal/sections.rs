//! Digital filter as a cascade of second-order sections.

use didim_dynamics::numeric::Scalar;

/// Section `H(z) = gain (1 + z⁻¹)ᵐ / (1 + a1 z⁻¹ + a2 z⁻²)`, multiplied out, with m = 2, or m = 1
/// for the section of a real pole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Section {
    /// Numerator, ascending powers of z⁻¹.
    pub(super) b: [f64; 3],
    /// Denominator without its leading 1: `[a1, a2]`.
    pub(super) a: [f64; 2],
}

impl Section {
    /// Returns true if the section has one real pole.
    pub(super) fn is_first_order(&self) -> bool {
        self.b[2] == 0.0 && self.a[1] == 0.0
    }

    /// Returns the gain at zero frequency.
    pub(super) fn steady_gain(&self) -> f64 {
        (self.b[0] + self.b[1] + self.b[2]) / (1.0 + self.a[0] + self.a[1])
    }

    /// Returns the state that a constant input of 1 settles to, and its output.
    pub(super) fn steady_state(&self) -> ([f64; 2], f64) {
        let ([b0, _, b2], [_, a2]) = (self.b, self.a);
        let y = self.steady_gain();
        ([y - b0, (1.0 - a2) * y + b2 - b0], y)
    }

    /// Filters one sample and updates the state of the section.
    ///
    /// ```text
    /// transposed direct form II   y = b0 x + z1     z1' = b1 x − a1 y + z2     z2' = b2 x − a2 y
    /// in z1 and w = z1 + z2       z1' = (b0 + b1) x + w − (1 + a1) y
    ///                             w'  = (b0 + b1 + b2) x + w − (1 + a1 + a2) y
    /// ```
    ///
    /// At a low cut-off z2 is nearly −z1. Rounding of both would lose their sum, which is the slope
    /// of the output. So w is stored instead of z2.
    #[inline(always)]
    pub(super) fn step<T: Scalar>(&self, x: T, z1: &mut T, w: &mut T) -> T {
        let ([b0, b1, b2], [a1, a2]) = (self.b, self.a);
        let y = T::constant(b0) * x + *z1;
        // Terms that do not depend on y come first.
        *z1 = T::constant(b0 + b1) * x + *w - T::constant(1.0 + a1) * y;
        *w = T::constant(b0 + b1 + b2) * x + *w - T::constant(1.0 + a1 + a2) * y;
        y
    }
}

/// Low-pass filter as a cascade of second-order sections. Unlike one long transfer function, it
/// keeps its response at a low cut-off in double precision.
///
/// It is created by [`butterworth_low_pass`](super::butterworth_low_pass) or
/// [`chebyshev1_low_pass`](super::chebyshev1_low_pass), so it is stable by construction. The
/// pairing of poles and zeros differs from SciPy's, the response does not.
#[derive(Clone, Debug, PartialEq)]
pub struct SecondOrderSections {
    pub(super) sections: Vec<Section>,
    order: usize,
}

impl SecondOrderSections {
    pub(super) fn new(sections: Vec<Section>, order: usize) -> Self {
        Self { sections, order }
    }

    /// Returns the number of poles.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Returns one row per section, `[b0, b1, b2, 1, a1, a2]`, in SciPy's format.
    pub fn rows(&self) -> impl Iterator<Item = [f64; 6]> + '_ {
        self.sections.iter().map(|s| [s.b[0], s.b[1], s.b[2], 1.0, s.a[0], s.a[1]])
    }

    /// Returns the complex response `(real, imaginary)` of one forward pass at `ratio` of the
    /// Nyquist frequency. Forward and backward together have its squared magnitude and no phase.
    pub fn response(&self, ratio: f64) -> (f64, f64) {
        // z⁻¹ = e^{−jω} with ω = π ratio.
        let (sin, cos) = (core::f64::consts::PI * ratio).sin_cos();
        let (z1, z2) = ((cos, -sin), (cos * cos - sin * sin, -2.0 * sin * cos));
        self.sections.iter().fold((1.0, 0.0), |(re, im), s| {
            let b = (s.b[0] + s.b[1] * z1.0 + s.b[2] * z2.0, s.b[1] * z1.1 + s.b[2] * z2.1);
            let a = (1.0 + s.a[0] * z1.0 + s.a[1] * z2.0, s.a[0] * z1.1 + s.a[1] * z2.1);
            let norm = a.0 * a.0 + a.1 * a.1;
            let h = ((b.0 * a.0 + b.1 * a.1) / norm, (b.1 * a.0 - b.0 * a.1) / norm);
            (re * h.0 - im * h.1, re * h.1 + im * h.0)
        })
    }
}
