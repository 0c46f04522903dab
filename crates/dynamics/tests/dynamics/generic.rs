//! The algorithms over another scalar: dual numbers carry a derivative along.

use didim_dynamics::dynamics::{Model, Workspace};

use super::arms::{Design, Random, difference, inverse, physical_parameters};
use super::dual::Dual;

#[test]
fn direct_dynamics_undoes_inverse_dynamics_with_their_derivatives() {
    for seed in 0..100 {
        let mut random = Random(seed);
        let mut design = Design::random(&mut random);
        design.sign = "{ model = \"tanh\", width_rad_s = 1.0 }";
        design.known_torques = seed % 2 == 1;
        let robot = design.robot();
        let (n, model) = (robot.joints(), Model::new(&robot));
        let parameters = physical_parameters(&mut random, &robot);
        let states = [3.0, 4.0, 9.0].map(|size| random.vector(n, size));
        let rates = [1.0; 3].map(|size| random.vector(n, size));

        // The torque along a line through states, by duals and by central differences.
        let dual = |values: &[f64], rates: &[f64]| -> Vec<Dual> {
            values.iter().zip(rates).map(|(value, rate)| Dual(*value, *rate)).collect()
        };
        let constants: Vec<Dual> = parameters.iter().map(|value| Dual(*value, 0.0)).collect();
        let [q, dq, ddq] = [0, 1, 2].map(|i| dual(&states[i], &rates[i]));
        let mut tau = vec![Dual(0.0, 0.0); n];
        let mut workspace = Workspace::new();
        model.inverse_dynamics(&mut workspace, &constants, &q, &dq, &ddq, &mut tau);
        fn states_at(
            step: f64,
            states: &[Vec<f64>; 3],
            rates: &[Vec<f64>; 3],
            model: &Model,
            parameters: &[f64],
        ) -> Vec<f64> {
            let [q, dq, ddq] = [0, 1, 2].map(|i| -> Vec<f64> {
                states[i].iter().zip(&rates[i]).map(|(x, rate)| x + step * rate).collect()
            });
            inverse(model, parameters, &q, &dq, &ddq)
        }
        let slope: Vec<f64> = states_at(1e-5, &states, &rates, &model, &parameters)
            .iter()
            .zip(states_at(-1e-5, &states, &rates, &model, &parameters))
            .map(|(after, before)| (after - before) / 2e-5)
            .collect();
        let derivative: Vec<f64> = tau.iter().map(|tau| tau.1).collect();
        assert!(difference(&derivative, &slope) < 1e-7);

        let mut back = vec![Dual(0.0, 0.0); n];
        model.direct_dynamics(&mut workspace, &constants, &q, &dq, &tau, &mut back).unwrap();
        for (found, expected) in back.iter().zip(&ddq) {
            assert!(difference(&[found.0, found.1], &[expected.0, expected.1]) < 1e-8);
        }
    }
}
