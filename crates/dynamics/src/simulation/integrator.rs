//! Explicit fixed-step integration of ẏ = f(t, y).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A fixed-step explicit Runge–Kutta method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// Bogacki and Shampine's third-order method with three stages (*A 3(2) pair of Runge–Kutta
    /// formulas*, Appl. Math. Lett. 2, 1989); the `ode3` of simulation tools.
    #[default]
    Ode3,
    /// The classical fourth-order method with four stages.
    Rk4,
}

/// The stages of one step: all the memory that an integration needs.
#[derive(Clone, Debug)]
pub(super) struct RungeKuttaStages {
    rates: [Vec<f64>; 4],
    stage: Vec<f64>,
}

impl RungeKuttaStages {
    pub(super) fn new(states: usize) -> Self {
        Self { rates: core::array::from_fn(|_| vec![0.0; states]), stage: vec![0.0; states] }
    }

    /// Returns the rate at the start of the step.
    pub(super) fn first_rate(&self) -> &[f64] {
        &self.rates[0]
    }

    /// Returns the first rate, for the caller to fill before the step.
    pub(super) fn first_rate_mut(&mut self) -> &mut [f64] {
        &mut self.rates[0]
    }

    /// Advances `y` over an interval in a number of equal steps. If `first_known`,
    /// [`Self::first_rate_mut`] already holds the rate at its beginning.
    ///
    /// # Errors
    /// Those of `f`; `y` is then where the step that failed began.
    pub(super) fn advance_over<E>(
        &mut self,
        method: Integrator,
        steps: u32,
        (start, length): (f64, f64),
        first_known: bool,
        y: &mut [f64],
        mut f: impl FnMut(f64, &[f64], &mut [f64]) -> Result<(), E>,
    ) -> Result<(), E> {
        let h = length / f64::from(steps);
        for k in 0..steps {
            let t = start + f64::from(k) * h;
            if k > 0 || !first_known {
                f(t, y, &mut self.rates[0])?;
            }
            self.advance(method, t, h, y, &mut f)?;
        }
        Ok(())
    }

    /// Advances `y` by `h` from time `t` when [`Self::first_rate_mut`] holds f(t, y).
    ///
    /// # Errors
    /// Those of `f`; `y` is unchanged then.
    pub(super) fn advance<E>(
        &mut self,
        method: Integrator,
        t: f64,
        h: f64,
        y: &mut [f64],
        mut f: impl FnMut(f64, &[f64], &mut [f64]) -> Result<(), E>,
    ) -> Result<(), E> {
        let [k1, k2, k3, k4] = &mut self.rates;
        let stage = &mut self.stage;
        match method {
            // y + h (2/9 k1 + 1/3 k2 + 4/9 k3)
            Integrator::Ode3 => {
                add_scaled(stage, y, 0.5 * h, k1);
                f(t + 0.5 * h, stage, k2)?;
                add_scaled(stage, y, 0.75 * h, k2);
                f(t + 0.75 * h, stage, k3)?;
                for (((y, k1), k2), k3) in y.iter_mut().zip(&*k1).zip(&*k2).zip(&*k3) {
                    *y += h / 9.0 * (2.0 * k1 + 3.0 * k2 + 4.0 * k3);
                }
            }
            // y + h/6 (k1 + 2 k2 + 2 k3 + k4)
            Integrator::Rk4 => {
                add_scaled(stage, y, 0.5 * h, k1);
                f(t + 0.5 * h, stage, k2)?;
                add_scaled(stage, y, 0.5 * h, k2);
                f(t + 0.5 * h, stage, k3)?;
                add_scaled(stage, y, h, k3);
                f(t + h, stage, k4)?;
                let rates = k1.iter().zip(&*k2).zip(&*k3).zip(&*k4);
                for (y, (((k1, k2), k3), k4)) in y.iter_mut().zip(rates) {
                    *y += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
                }
            }
        }
        Ok(())
    }
}

/// Computes stage = y + h k.
fn add_scaled(stage: &mut [f64], y: &[f64], h: f64, k: &[f64]) {
    for ((stage, y), k) in stage.iter_mut().zip(y).zip(k) {
        *stage = y + h * k;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ÿ = −y + cos 2t has y = (4 cos t − cos 2t)/3 + sin t for y(0) = 1, ẏ(0) = 1; depends on
    /// time, so that wrong stage times are seen.
    fn error_at_two(method: Integrator, steps: u32) -> f64 {
        let h = 2.0 / f64::from(steps);
        let f = |t: f64, y: &[f64], rate: &mut [f64]| -> Result<(), ()> {
            rate[0] = y[1];
            rate[1] = -y[0] + (2.0 * t).cos();
            Ok(())
        };
        let mut stages = RungeKuttaStages::new(2);
        let mut y = [1.0, 1.0];
        for k in 0..steps {
            let t = f64::from(k) * h;
            f(t, &y, stages.first_rate_mut()).unwrap();
            stages.advance(method, t, h, &mut y, f).unwrap();
        }
        let exact = (4.0 * 2.0_f64.cos() - 4.0_f64.cos()) / 3.0 + 2.0_f64.sin();
        (y[0] - exact).abs()
    }

    #[test]
    fn halving_the_step_shows_the_order() {
        for (method, order) in [(Integrator::Ode3, 3.0), (Integrator::Rk4, 4.0)] {
            for steps in [50, 100, 200] {
                let ratio = error_at_two(method, steps) / error_at_two(method, 2 * steps);
                assert!((ratio.log2() - order).abs() < 0.1, "{method:?} {steps}: {}", ratio.log2());
            }
        }
    }

    #[test]
    fn a_failed_stage_leaves_the_state_alone() {
        let mut stages = RungeKuttaStages::new(1);
        let mut y = [3.0];
        let mut calls = 0;
        let failed = stages.advance(Integrator::Rk4, 0.0, 0.1, &mut y, |_, _, _| {
            calls += 1;
            if calls == 3 { Err("third") } else { Ok(()) }
        });
        assert_eq!(failed, Err("third"));
        assert!((y[0] - 3.0).abs() < f64::EPSILON);
    }
}
