//! The work of torques and gravity becomes kinetic energy, and nothing else does.

use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::robot::ParameterKind::{Ia, M, Mx, My, Mz, Xx, Xy, Xz, Yy, Yz, Zz};

use super::arms::{mass_matrix, multiply, physical_parameters, random_robots};

/// Position, velocity, and the work done on the arm so far.
type State = (Vec<f64>, Vec<f64>, f64);

fn next_state((q, dq, work): &State, (v, a, power): &State, step: f64) -> State {
    let add = |x: &[f64], dx: &[f64]| x.iter().zip(dx).map(|(x, dx)| x + step * dx).collect();
    (add(q, v), add(dq, a), work + step * power)
}

#[test]
fn energy_is_conserved_without_friction() {
    const STEP: f64 = 2e-4;
    for (mut random, robot) in random_robots(40) {
        let (n, model) = (robot.joints(), Model::new(&robot));
        let mut parameters = physical_parameters(&mut random, &robot);
        for (value, parameter) in parameters.iter_mut().zip(robot.parameters().parameters()) {
            if !matches!(parameter.kind, Xx | Xy | Xz | Yy | Yz | Zz | Mx | My | Mz | M | Ia) {
                *value = 0.0;
            }
        }
        let tau = random.vector(n, 2.0);
        let mut workspace = Workspace::new();
        let mut slope = |(q, dq, _): &State| -> State {
            let mut ddq = vec![0.0; n];
            model.direct_dynamics(&mut workspace, &parameters, q, dq, &tau, &mut ddq).unwrap();
            let mut gravity = vec![0.0; n];
            model.bias(&mut workspace, &parameters, q, &vec![0.0; n], &mut gravity);
            let power = (0..n).map(|j| (tau[j] - gravity[j]) * dq[j]).sum();
            (dq.clone(), ddq, power)
        };
        fn kinetic((q, dq, _): &State, model: &Model, parameters: &[f64]) -> f64 {
            let momentum = multiply(&mass_matrix(model, parameters, q), dq);
            0.5 * momentum.iter().zip(dq).map(|(p, v)| p * v).sum::<f64>()
        }

        let mut state: State = (random.vector(n, 3.0), random.vector(n, 1.0), 0.0);
        let start = kinetic(&state, &model, &parameters);
        for _ in 0..1000 {
            // Runge–Kutta, fourth order.
            let k1 = slope(&state);
            let k2 = slope(&next_state(&state, &k1, STEP / 2.0));
            let k3 = slope(&next_state(&state, &k2, STEP / 2.0));
            let k4 = slope(&next_state(&state, &k3, STEP));
            state = [(k1, 6.0), (k2, 3.0), (k3, 3.0), (k4, 6.0)]
                .iter()
                .fold(state, |state, (k, share)| next_state(&state, k, STEP / share));
        }
        let gained = kinetic(&state, &model, &parameters) - start;
        let size = start.abs().max(state.2.abs());
        assert!(size > 1e-3, "the arm has moved");
        assert!((gained - state.2).abs() < 1e-7 * size, "{gained} for {} of work", state.2);
    }
}
