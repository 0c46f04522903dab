//! A constant angle of the geometry, stored as its cosine and sine.

/// Cosine and sine of a constant angle; exactly 0 and ±1 at multiples of 90°.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angle {
    /// Cosine.
    pub cos: f64,
    /// Sine.
    pub sin: f64,
}

impl Angle {
    /// Creates an angle from degrees. In radians 90° is not exact and its cosine would be 6e-17;
    /// parameters without effect would then seem to have one.
    pub fn from_degrees(degrees: f64) -> Self {
        if degrees % 90.0 == 0.0 {
            let turn = degrees.rem_euclid(360.0);
            let (cos, sin) = if turn < 45.0 {
                (1.0, 0.0)
            } else if turn < 135.0 {
                (0.0, 1.0)
            } else if turn < 225.0 {
                (-1.0, 0.0)
            } else {
                (0.0, -1.0)
            };
            Self { cos, sin }
        } else {
            let (sin, cos) = degrees.to_radians().sin_cos();
            Self { cos, sin }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Angle;

    #[test]
    fn quarter_turns_are_exact() {
        for turns in -3..4 {
            for (quarter, cos, sin) in
                [(0, 1.0, 0.0), (1, 0.0, 1.0), (2, -1.0, 0.0), (3, 0.0, -1.0)]
            {
                let angle = Angle::from_degrees(f64::from(turns * 360 + quarter * 90));
                assert_eq!(angle, Angle { cos, sin });
            }
        }
        let angle = Angle::from_degrees(30.0);
        assert!((angle.sin - 0.5).abs() < 1e-15 && (angle.cos - 0.75_f64.sqrt()).abs() < 1e-15);
    }
}
