//! Base parameters: the TX40's against the published list, and their defining identity on random
//! arms.

use didim_dynamics::dynamics::{BaseParameters, Model, Workspace};
use didim_dynamics::robot::FrictionLaw;

use super::arms::{Design, Random, difference, inverse, multiply, random_robots, tx40};

/// The regrouped inertial parameters of the TX40, as published.
const TX40_REGROUPED: [(&str, &str); 15] = [
    ("zz1r", "zz1 + ia1 + yy2 + yy3 + 0.07 mz3 + 0.05185 (m3+m4+m5+m6)"),
    ("xx2r", "xx2 - yy2 - 0.050625 (m3+m4+m5+m6)"),
    ("xz2r", "xz2 - 0.225 mz3 - 0.007875 (m3+m4+m5+m6)"),
    ("zz2r", "zz2 + ia2 + 0.050625 (m3+m4+m5+m6)"),
    ("mx2r", "mx2 + 0.225 (m3+m4+m5+m6)"),
    ("xx3r", "xx3 - yy3 + yy4 + 0.45 mz4 + 0.050625 (m4+m5+m6)"),
    ("zz3r", "zz3 + yy4 + 0.45 mz4 + 0.050625 (m4+m5+m6)"),
    ("my3r", "my3 - mz4 - 0.225 (m4+m5+m6)"),
    ("xx4r", "xx4 - yy4 + yy5"),
    ("zz4r", "zz4 + yy5"),
    ("my4r", "my4 + mz5"),
    ("xx5r", "xx5 - yy5 + yy6"),
    ("zz5r", "zz5 + yy6"),
    ("my5r", "my5 - mz6"),
    ("xx6r", "xx6 - yy6"),
];

/// The terms of a sum as printed.
fn terms(expression: &str) -> Vec<(&str, f64)> {
    let mut terms = Vec::new();
    let (mut sign, mut size) = (1.0, 1.0);
    for word in expression.split([' ', '(', ')']).filter(|word| !word.is_empty()) {
        match (word, word.parse::<f64>()) {
            ("+", _) => (sign, size) = (1.0, 1.0),
            ("-", _) => (sign, size) = (-1.0, 1.0),
            (_, Ok(number)) => size = number,
            (names, _) => terms.extend(names.split('+').map(|name| (name, sign * size))),
        }
    }
    terms
}

#[test]
fn tx40_has_the_published_base_parameters() {
    let base = BaseParameters::compute(&Model::new(&tx40())).unwrap();
    let expected: Vec<&str> = "\
        zz1r fv1 fc1 off1 \
        xx2r xy2 xz2r yz2 zz2r mx2r my2 fv2 fc2 off2 \
        xx3r xy3 xz3 yz3 zz3r mx3 my3r ia3 fv3 fc3 off3 \
        xx4r xy4 xz4 yz4 zz4r mx4 my4r ia4 fv4 fc4 off4 \
        xx5r xy5 xz5 yz5 zz5r mx5 my5r ia5 fv5 fc5 off5 \
        xx6r xy6 xz6 yz6 zz6 mx6 my6 ia6 fv6 fc6 off6 \
        fv_m6 fc_m6"
        .split_whitespace()
        .collect();
    assert_eq!(base.names(), expected);
    fn count(kinds: &[&str], base: &BaseParameters) -> usize {
        let of_kind = |name: &&String| {
            kinds.contains(&name.trim_end_matches('r').trim_end_matches(char::is_numeric))
        };
        base.names().iter().filter(of_kind).count()
    }
    let inertial = ["xx", "xy", "xz", "yy", "yz", "zz", "mx", "my", "mz", "m"];
    assert_eq!((count(&inertial, &base), count(&["ia"], &base), base.names().len()), (36, 4, 60));
    let without = "xx1 xy1 xz1 yy1 yz1 mx1 my1 mz1 m1 mz2 m2";
    assert_eq!(base.without_effect().join(" "), without);
}

#[test]
fn tx40_regroups_as_published() {
    let robot = tx40();
    let base = BaseParameters::compute(&Model::new(&robot)).unwrap();
    for (row, name) in base.names().iter().enumerate() {
        let published = TX40_REGROUPED.iter().find(|(own, _)| own == name);
        let expression = published.map_or(name.as_str(), |(_, expression)| expression);
        assert_eq!(base.expression(name).as_deref(), Some(expression));
        let terms = terms(expression);
        for (column, standard) in robot.parameters().names().iter().enumerate() {
            let expected = terms.iter().find(|(own, _)| own == standard).map_or(0.0, |term| term.1);
            let coefficient = base.regrouping()[(row, column)];
            assert!((coefficient - expected).abs() < 1e-9, "{name}, {standard}: {coefficient}");
        }
    }
    assert_eq!(base.expression("zz1"), None);
}

#[test]
fn base_parameters_have_the_dynamics_of_the_standard_ones() {
    for (mut random, robot) in random_robots(60) {
        let model = Model::new(&robot);
        let base = BaseParameters::compute(&model).unwrap();
        let (n, p, b) = (model.joints(), model.parameter_names().len(), base.names().len());
        let parameters = random.vector(p, 1.0);
        let regrouped = base.to_base(&parameters);
        for _ in 0..5 {
            let (q, dq, ddq) =
                (random.vector(n, 3.0), random.vector(n, 4.0), random.vector(n, 9.0));
            let tau = inverse(&model, &parameters, &q, &dq, &ddq);
            let mut full = vec![0.0; n * p];
            model.regressor(&mut Workspace::new(), &q, &dq, &ddq, &mut full);
            let mut columns = vec![0.0; n * b];
            base.select_columns(&full, &mut columns);
            assert!(difference(&multiply(&columns, &regrouped), &tau) < 1e-8);

            let values = base.names().iter().zip(regrouped.iter().copied());
            let equivalent = base.to_standard(values).unwrap();
            assert!(difference(&inverse(&model, &equivalent, &q, &dq, &ddq), &tau) < 1e-8);
        }
    }
}

#[test]
fn a_vertical_sliding_axis_keeps_its_mass() {
    // A mast: prismatic along gravity, with a drive. m and ia differ by the weight, which the
    // offset takes.
    let design = Design {
        gravity: [0.0, 0.0, -9.81],
        joints: vec![(true, [0.0; 4], true)],
        rows: vec![vec![100.0]],
        friction: [true, true, true],
        sign: "{ model = \"sign\" }",
        own_friction: vec![None],
        known_torques: false,
    };
    let base = BaseParameters::compute(&Model::new(&design.robot())).unwrap();
    assert_eq!(base.names(), ["m1r", "fv1", "fc1", "off1r"]);
    assert_eq!(base.expression("m1r").unwrap(), "m1 + ia1");
    assert_eq!(base.expression("off1r").unwrap(), "off1 - 9.81 ia1");

    // Its load is always the same: a share of it is Coulomb friction, of no size that every mast
    // has.
    let robot = design.robot();
    let loaded = vec![robot.own_friction()[0].with_law(FrictionLaw::Load)];
    let base = BaseParameters::compute(&Model::new(&robot.with_friction(loaded))).unwrap();
    assert_eq!(base.names(), ["m1r", "fv1", "fc1", "off1r"]);
    assert_eq!(base.without_effect().last().unwrap(), "fcl1");
}

#[test]
fn a_planar_arm_of_two_joints_has_its_textbook_parameters() {
    // SCARA's first two axes, both along gravity: ZZ1 + Ia1 + d² M2, ZZ2, MX2, MY2, Ia2.
    let mut design = Design::random(&mut Random(0));
    design.gravity = [0.0, 0.0, -9.81];
    design.joints = vec![(false, [0.0; 4], true), (false, [0.0, 0.5, 0.0, 0.0], true)];
    design.rows = vec![vec![50.0, 0.0], vec![0.0, 50.0]];
    design.friction = [false, false, false];
    design.own_friction = vec![None, None];
    let base = BaseParameters::compute(&Model::new(&design.robot())).unwrap();
    assert_eq!(base.names(), ["zz1r", "zz2", "mx2", "my2", "ia2"]);
    assert_eq!(base.expression("zz1r").unwrap(), "zz1 + ia1 + 0.25 m2");
}

#[test]
fn an_unknown_base_parameter_is_named() {
    let base = BaseParameters::compute(&Model::new(&tx40())).unwrap();
    let error = base.to_standard([("zz1", 1.0)]).unwrap_err();
    assert_eq!(error.name, "zz1");
    assert!(error.to_string().contains("zz1r"));
}
