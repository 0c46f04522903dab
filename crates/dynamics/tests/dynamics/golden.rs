//! Golden values of an independent implementation, `golden/lagrange.py`.

use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::robot::Robot;

use super::arms::{difference, inverse, mass_matrix, tx40_physical};

const GOLDEN: &str = include_str!("../golden/lagrange.csv");
const SLIDING_ARM: &str = include_str!("../golden/sliding-arm.toml");

#[test]
fn agrees_with_lagranges_equations() {
    let robots = [tx40_physical(), Robot::from_toml(SLIDING_ARM).unwrap()];
    let mut checked = [0; 2];
    for line in GOLDEN.lines().filter(|line| !line.starts_with('#')) {
        let (name, numbers) = line.split_once(',').unwrap();
        let numbers: Vec<f64> = numbers.split(',').map(|number| number.parse().unwrap()).collect();
        let index = robots.iter().position(|robot| robot.name() == name).unwrap();
        let (robot, model) = (&robots[index], Model::new(&robots[index]));
        let n = robot.joints();
        assert_eq!(numbers.len(), 4 * n + n * n);
        let [q, dq, ddq, tau] = [0, 1, 2, 3].map(|part| &numbers[part * n..(part + 1) * n]);
        let mass = &numbers[4 * n..];

        let parameters = robot.nominal().unwrap().standard_parameters();
        assert!(difference(&inverse(&model, parameters, q, dq, ddq), tau) < 1e-12);
        assert!(difference(&mass_matrix(&model, parameters, q), mass) < 1e-12);
        let mut back = vec![f64::NAN; n];
        let mut workspace = Workspace::new();
        model.direct_dynamics(&mut workspace, parameters, q, dq, tau, &mut back).unwrap();
        assert!(difference(&back, ddq) < 1e-10);
        checked[index] += 1;
    }
    assert_eq!(checked, [8, 8]);
}
