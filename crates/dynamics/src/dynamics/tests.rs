use super::{Model, Workspace};
use crate::MAX_JOINTS;
use crate::numeric::{Lanes, Scalar, WIDTH};
use crate::robot::Robot;

type Four = Lanes<WIDTH>;

/// The kernels as compiled for the baseline, called next to the chosen ones.
#[test]
fn every_instruction_set_gives_the_same() {
    let file = include_str!("../../../../config/robots/tx40-physical.toml");
    let robot = Robot::from_toml(file).unwrap();
    let model = Model::new(&robot);
    let n = model.joints();
    let parameters: Vec<_> = robot
        .nominal()
        .unwrap()
        .standard_parameters()
        .iter()
        .map(|&value| Four::constant(value))
        .collect();
    let [mut chosen, mut plain] = [[Four::zero(); MAX_JOINTS]; 2];
    let size = n * parameters.len();
    let [mut chosen_matrix, mut plain_matrix] =
        [vec![Four::zero(); size], vec![Four::zero(); size]];
    let mut ws = Workspace::new();
    let mut compared = 0;
    let mut same = |chosen: &[Four], plain: &[Four]| {
        for (chosen, plain) in chosen.iter().zip(plain) {
            for (chosen, plain) in chosen.0.iter().zip(plain.0) {
                assert!((chosen - plain).abs() <= 1e-9 * plain.abs(), "{chosen}, {plain}");
                compared += 1;
            }
        }
    };
    for k in 0..50 {
        let [q, dq, ddq, tau] = [0, 1, 2, 3].map(|what: i32| -> Vec<Four> {
            let value = |joint, lane| (f64::from(what + 4 * k + 7 * lane) + joint as f64).sin();
            (0..n)
                .map(|joint| Four::from_fn(|lane| value(joint, i32::try_from(lane).unwrap()) * 5.0))
                .collect()
        });
        let (chosen, plain) = (&mut chosen[..n], &mut plain[..n]);
        model.direct_dynamics(&mut ws, &parameters, &q, &dq, &tau, chosen).unwrap();
        model
            .solve_inward::<_, MAX_JOINTS>(&mut ws, &parameters, &[], &q, &dq, &tau, plain)
            .unwrap();
        same(chosen, plain);
        model.regressor(&mut ws, &q, &dq, &ddq, &mut chosen_matrix);
        model.compute_poses(&mut ws, &q);
        let columns = &model.all_columns;
        model.regressor_of_poses(&mut ws, columns, None, &dq, &ddq, &mut plain_matrix);
        same(&chosen_matrix, &plain_matrix);
    }
    assert_eq!(compared, 50 * 4 * (n + size));
}
