//! The path parameter of one move: from 0 to 1 with trapezoidal velocity.

/// s(t) from 0 to 1: constant acceleration, constant velocity (perhaps for no time at all),
/// constant deceleration (Khalil & Dombre, *Modeling, Identification and Control of Robots*,
/// section 13.3.4).
///
/// With the limits v on ṡ and a on s̈, both in 1/s and 1/s²:
///
/// ```text
/// v² < a:  t_a = v/a        T = 1/v + t_a     trapezoid
/// v² ≥ a:  t_a = 1/√a       T = 2 t_a         triangle, the peak velocity is a t_a = √a
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Trapezoid {
    acceleration: f64,
    ramp_s: f64,
    duration_s: f64,
}

impl Trapezoid {
    /// Creates the fastest profile within ṡ ≤ `velocity` and |s̈| ≤ `acceleration`, both positive.
    pub(super) fn new(velocity: f64, acceleration: f64) -> Self {
        if velocity * velocity < acceleration {
            let ramp_s = velocity / acceleration;
            Self { acceleration, ramp_s, duration_s: 1.0 / velocity + ramp_s }
        } else {
            let ramp_s = 1.0 / acceleration.sqrt();
            Self { acceleration, ramp_s, duration_s: 2.0 * ramp_s }
        }
    }

    /// Returns its duration \[s\].
    pub(super) fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Returns s, ṡ and s̈ at a time since the start \[s\]; at rest outside the move. At a switch
    /// of the acceleration the value is that of the phase that begins.
    pub(super) fn evaluate(&self, time_s: f64) -> (f64, f64, f64) {
        let left_s = self.duration_s - time_s;
        if time_s < 0.0 {
            (0.0, 0.0, 0.0)
        } else if left_s <= 0.0 {
            (1.0, 0.0, 0.0)
        } else if time_s < self.ramp_s {
            (
                0.5 * self.acceleration * time_s * time_s,
                self.acceleration * time_s,
                self.acceleration,
            )
        } else if left_s <= self.ramp_s {
            (
                1.0 - 0.5 * self.acceleration * left_s * left_s,
                self.acceleration * left_s,
                -self.acceleration,
            )
        } else {
            let velocity = self.acceleration * self.ramp_s;
            (velocity * (time_s - 0.5 * self.ramp_s), velocity, 0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_meet_and_derivatives_agree() {
        for (velocity, acceleration) in [(1.0, 4.0), (2.0, 4.0), (5.0, 4.0), (0.3, 50.0)] {
            let profile = Trapezoid::new(velocity, acceleration);
            let step = profile.duration_s() / 1000.0;
            let (mut s_sum, mut last) = (0.0, profile.evaluate(0.0));
            assert_eq!((last.0, last.1), (0.0, 0.0));
            for k in 1..=1000 {
                let now = profile.evaluate(f64::from(k) * step);
                assert!(now.1 <= velocity * (1.0 + 1e-12) && now.2.abs() <= acceleration);
                // The trapezoidal rule is exact for a velocity that is linear between samples; the
                // two steps with a switch inside are off by less than a step's corner.
                s_sum += 0.5 * step * (now.1 + last.1);
                assert!((now.0 - s_sum).abs() < 2.0 * acceleration * step * step, "{k}");
                last = now;
            }
            assert!((last.0 - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_short_way_has_no_plateau() {
        let profile = Trapezoid::new(10.0, 16.0);
        assert!((profile.duration_s() - 0.5).abs() < 1e-15);
        let (s, velocity, _) = profile.evaluate(0.25);
        assert!((s - 0.5).abs() < 1e-15 && (velocity - 4.0).abs() < 1e-12);
    }
}
