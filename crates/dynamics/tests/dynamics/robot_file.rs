//! What the reader of robot files takes, and how it refuses the rest.

use didim_dynamics::robot::{
    JointIndex, MotorIndex, Robot, RobotError, SignModel, TransmissionError,
};

use super::arms::{Random, TX40, difference, random_robots, tx40};

/// The error for the TX40's file with one piece of text replaced, and the line of that piece.
fn refused(from: &str, to: &str) -> (RobotError, usize) {
    let start = TX40.find(from).unwrap();
    let line = 1 + TX40[..start].matches('\n').count();
    (Robot::from_toml(&TX40.replacen(from, to, 1)).unwrap_err(), line)
}

#[test]
fn the_tx40_is_read_in_si_units() {
    let robot = tx40();
    assert_eq!((robot.name(), robot.joints()), ("tx40", 6));
    let limits = *robot.limits().nth(4).unwrap();
    assert!((limits.position_max - 133.5_f64.to_radians()).abs() < 1e-15);
    assert_eq!((limits.velocity_max, limits.torque_max), (Some(5.585), Some(43.19)));
    let without_limit = TX40.replacen("torque_max_nm = 43.19", "torque_max_nm = \"unknown\"", 1);
    let without_limit = Robot::from_toml(&without_limit).unwrap();
    let torques: Vec<bool> = without_limit.limits().map(|of| of.torque_max.is_some()).collect();
    assert_eq!(torques, [true, true, true, true, false, true]);
    assert_eq!(robot.sign_model(0), SignModel::Tanh { width_rad_s: 0.05 });
    assert_eq!(robot.with_sign_model(SignModel::Sign).sign_model(0), SignModel::Sign);
}

#[test]
fn unknown_keys_and_wrong_units_name_the_key_and_the_line() {
    for (from, to, key) in [
        ("alpha_deg", "alpha_rad", "alpha_rad"),
        ("name =", "nome =", "nome"),
        ("viscous", "viscosity", "viscosity"),
        ("rows", "matrix", "matrix"),
    ] {
        let (error, line) = refused(from, to);
        let RobotError::Format { line: found, message } = &error else { panic!("{error}") };
        assert_eq!(*found, line);
        assert!(message.contains(key), "{message}");
    }
}

#[test]
fn values_of_the_wrong_type_or_count_are_refused_with_their_line() {
    for (from, to) in [
        ("\"revolute\"", "\"round\""),
        ("[0.0, 0.0, -9.81]", "[0.0, -9.81]"),
        ("drive_inertia = true", "drive_inertia = 1"),
        ("r_m = 0.32", "r_m = \"0.32\""),
        ("{ model = \"tanh\", width_rad_s = 0.05 }", "{ model = \"stribeck\" }"),
        ("width_rad_s = 0.05 }", "width_rad_s = 0.0 }"),
        ("width_rad_s = 0.05 }", "width_rad_s = 0.05, threshold_rad_s = 0.1 }"),
        ("width_rad_s = 0.05 }", "width_deg_s = 0.05 }"),
    ] {
        let (error, line) = refused(from, to);
        assert!(matches!(error, RobotError::Format { line: l, .. } if l == line), "{to}: {error}");
    }
}

#[test]
fn numbers_that_make_no_arm_are_refused() {
    for (from, to, key) in [
        ("d_m = 0.225", "d_m = inf", "d_m"),
        ("theta_deg = 90.0", "theta_deg = nan", "theta_deg"),
        ("zz1r = 1.24", "zz1r = nan", "zz1r"),
        ("[0.0, 0.0, -9.81]", "[0.0, 0.0, nan]", "gravity_m_s2"),
    ] {
        let (error, line) = refused(from, to);
        assert_eq!(error, RobotError::NotFinite { key: key.into(), line });
    }

    let (error, line) = refused("position_min_deg = -138.0", "position_min_deg = 138.0");
    let (min, max) = ("position_min_deg", "position_max_deg");
    assert_eq!(error, RobotError::LimitOrder { joint: JointIndex::new(2), min, max, line });

    let (error, line) = refused("torque_max_nm = 103.49", "torque_max_nm = 0.0");
    assert_eq!(
        error,
        RobotError::NotPositive { joint: JointIndex::new(2), key: "torque_max_nm", line }
    );

    let (error, line) = refused("velocity_max_rad_s = 7.504", "velocity_max_m_s = 7.504");
    let (key, instead) = ("velocity_max_m_s", "velocity_max_rad_s");
    assert_eq!(error, RobotError::WrongUnit { joint: JointIndex::new(2), key, instead, line });

    let of_motions = |line: &str| format!("velocity_max_rad_s = 7.504\n{line}");
    let (error, _) =
        refused("velocity_max_rad_s = 7.504", &of_motions("acceleration_max_rad_s2 = -1.0"));
    let RobotError::NotPositive { joint, key: "acceleration_max_rad_s2", .. } = error else {
        panic!("{error}")
    };
    assert_eq!(joint, JointIndex::new(2));
    let (error, _) = refused("velocity_max_rad_s = 7.504", &of_motions("jerk_max_m_s3 = 100.0"));
    let RobotError::WrongUnit { key: "jerk_max_m_s3", instead: "jerk_max_rad_s3", .. } = error
    else {
        panic!("{error}")
    };

    let (error, _) = refused("torque_max_nm = 103.49", "");
    let RobotError::MissingLimit { joint, key, .. } = error else { panic!("{error}") };
    assert_eq!((joint, key), (JointIndex::new(2), "torque_max_nm"));

    let (error, line) = refused("torque_max_nm = 103.49", "torque_max_nm = \"high\"");
    let RobotError::Format { line: at, message } = error else { panic!("{error}") };
    assert_eq!(at, line);
    assert!(message.contains("a number, or \"unknown\""), "{message}");

    let (error, line) = refused("name = \"tx40\"", "name = \" \"");
    assert_eq!(error, RobotError::EmptyName { line });
    for hidden in ["\\n", "\\u202e", "\\u200b", "\\u2066", "\\ufeff"] {
        let (error, line) = refused("name = \"tx40\"", &format!("name = \"tx{hidden}40\""));
        assert_eq!(error, RobotError::ControlInName { line }, "{hidden}");
    }
}

#[test]
fn transmissions_that_do_not_fit_are_refused() {
    let rows = |to: &str| match refused("[0.0, 0.0, 0.0, 0.0, 45.0, 0.0]", to).0 {
        RobotError::Transmission { source, .. } => source,
        other => panic!("{other}"),
    };
    let length = TransmissionError::RowLength { motor: MotorIndex::new(4), found: 2, expected: 6 };
    assert_eq!(rows("[0.0, 45.0]"), length);
    assert_eq!(
        rows("[0, 0, 0, 0, inf, 0]"),
        TransmissionError::NotFinite { motor: MotorIndex::new(4) }
    );
    assert_eq!(
        rows("[0, 0, 0, 0, 0, 1]"),
        TransmissionError::ZeroRatio { motor: MotorIndex::new(4) }
    );
    assert_eq!(rows("[0, 0, 0, 0, 45, 45]"), TransmissionError::Singular);
    let (error, _) = refused("  [0.0, 0.0, 0.0, 0.0, 45.0, 0.0],\n", "");
    let source = TransmissionError::RowCount { found: 5, expected: 6 };
    assert!(matches!(error, RobotError::Transmission { source: s, .. } if s == source));
}

#[test]
fn an_arm_has_1_to_16_joints() {
    let joint = |n: usize| {
        let (head, rest) = TX40.split_once("[[joint]]").unwrap();
        let (_, tail) = rest.split_once("# q_motor").unwrap();
        let joint = rest.split_once("[[joint]]").unwrap().0;
        format!("{head}{}# q_motor{tail}", format!("[[joint]]{joint}").repeat(n))
    };
    for found in [0, 17] {
        let error = Robot::from_toml(&joint(found)).unwrap_err();
        assert_eq!(error, RobotError::JointCount { found, largest: 16 });
    }
}

#[test]
fn sign_model_goes_with_coulomb_friction() {
    let (error, _) = refused("coulomb = true", "coulomb = false");
    assert!(matches!(error, RobotError::SignModel { .. }));
    let (error, _) = refused("sign = { model = \"tanh\", width_rad_s = 0.05 }", "");
    assert!(matches!(error, RobotError::SignModel { .. }));
}

#[test]
fn a_joint_may_have_friction_of_its_own() {
    let text = TX40.replacen("offset = true", "offset = true\nquadratic = true", 1).replacen(
        "torque_max_nm = 103.49",
        "torque_max_nm = 103.49\nfriction = { quadratic = false, load = true, stribeck_rad_s = \
         0.2, sign = { model = \"sign\" } }",
        1,
    );
    let robot = Robot::from_toml(&text).unwrap();
    let table = robot.parameters();
    fn of_joint(joint: usize, table: &didim_dynamics::robot::ParameterTable) -> Vec<&str> {
        let joint_names = table
            .parameters()
            .iter()
            .zip(table.names())
            .filter(|(p, _)| p.joint == JointIndex::new(joint));
        joint_names.map(|(_, name)| name.as_str()).skip(10).collect::<Vec<_>>()
    }
    assert_eq!(of_joint(1, table), ["ia2", "fv2", "fvq2", "fc2", "off2"]);
    assert_eq!(of_joint(2, table), ["ia3", "fv3", "fc3", "fcl3", "fs3", "off3"]);
    assert_eq!(robot.sign_model(2), SignModel::Sign);
    assert_eq!(robot.sign_model(1), SignModel::Tanh { width_rad_s: 0.05 });
    // What a joint's friction is shown as can be put into a file that has no law for all joints.
    let shown = format!("torque_max_nm = 103.49\n{}", robot.own_friction_toml(2));
    let again = Robot::from_toml(&TX40.replacen("torque_max_nm = 103.49", &shown, 1)).unwrap();
    assert_eq!(again.own_friction()[2], robot.own_friction()[2]);
    // What the file states of the arm keeps its places.
    let (changed, plain) = (robot.nominal().unwrap(), tx40());
    assert_eq!(changed.given_values(), plain.nominal().unwrap().given_values());
    assert_eq!(plain.clone().with_friction(robot.own_friction().to_vec()), robot);
    assert_eq!(robot.with_friction(plain.own_friction().to_vec()), plain);
}

#[test]
fn friction_that_makes_no_sense_is_refused_with_its_line() {
    let refused_friction = |friction: &str| {
        let joint_text = format!("torque_max_nm = 103.49\nfriction = {friction}");
        let (error, line) = refused("torque_max_nm = 103.49", &joint_text);
        (error, line + 1)
    };
    for friction in [
        "{ stribeck_rad_s = 0.0 }",
        "{ hysteresis_rad = -0.1 }",
        "{ hysteresis_rad = 9.0 }",
        "{ quadratisch = true }",
    ] {
        let (error, line) = refused_friction(friction);
        let RobotError::Format { line: found, message } = &error else { panic!("{error}") };
        assert_eq!(*found, line);
        assert!(message.contains(&friction[2..10]), "{message}");
    }
    let without = TX40
        .replacen("coulomb = true\n", "coulomb = false\n", 1)
        .replacen("sign = { model = \"tanh\", width_rad_s = 0.05 }\n", "", 1)
        .replacen("offset = true", "offset = true\nstribeck_rad_s = 0.1", 1);
    let error = Robot::from_toml(&without).unwrap_err();
    assert!(matches!(error, RobotError::SignModel { .. }), "{error}");
}

/// What is wrong with a known torque is said with its line.
#[test]
fn known_torques_that_make_no_sense_are_refused_with_their_line() {
    fn refused_table(table: &str) -> String {
        let joint_text = format!("torque_max_nm = 103.49\nknown_torque = {table}");
        let (error, line) = refused("torque_max_nm = 103.49", &joint_text);
        let RobotError::Format { line: found, message } = &error else { panic!("{error}") };
        assert_eq!(*found, line + 1, "{message}");
        message.clone()
    }
    let cylinder = |base: f64, stiffness: f64| {
        refused_table(&format!(
            "{{ counterbalance = {{ base_radius_m = {base}, link_radius_m = 0.2, closest_deg = 0, \
             pull_n = 9e3, length_m = 0.6, stiffness_n_m = {stiffness} }} }}"
        ))
    };
    for (found, expected) in [
        (cylinder(0.2, 1.0), "would meet"),
        (cylinder(-0.7, 1.0), "`base_radius_m` is -0.7"),
        (cylinder(0.7, -1.0), "`stiffness_n_m` is -1"),
        (refused_table("{ position_deg = [-200, 200], torque_nm = [0, nan] }"), "finite"),
        (refused_table("{ position_deg = [-200, 200], torque_nm = [0] }"), "as many of each"),
        (refused_table("{ position_deg = [200, -200], torque_nm = [0, 1] }"), "increase"),
        (refused_table("{ position_deg = [-20, 20], torque_nm = [0, 1] }"), "from limit to limit"),
        (
            refused_table("{ position_m = [-20, 20], force_n = [0, 1] }"),
            "`position_deg` and `torque_nm`",
        ),
        (refused_table("{ spring = 3 }"), "spring"),
    ] {
        assert!(found.contains(expected), "{found}");
    }
}

#[test]
fn nominal_parameters_are_the_robots_own() {
    let (error, line) = refused("zz1r = 1.24", "zz7r = 1.24");
    let RobotError::UnknownParameter { name, line: found, .. } = error else { panic!("{error}") };
    assert_eq!((name.as_str(), found), ("zz7r", line));

    let (error, line) = refused("fv1 = 8.0", "zz1 = 8.0");
    assert_eq!(error, RobotError::DuplicateParameter { name: "zz1".into(), line });
}

#[test]
fn transmission_goes_both_ways_and_keeps_power() {
    for (mut random, robot) in random_robots(100) {
        let (n, r) = (robot.joints(), robot.transmission());
        let (dq, torque) = (random.vector(n, 3.0), random.vector(n, 2.0));
        let mut motor_speed = vec![0.0; n];
        let mut back = vec![0.0; n];
        r.motor_position(&dq, &mut motor_speed);
        r.joint_position(&motor_speed, &mut back);
        assert!(difference(&back, &dq) < 1e-12);
        let mut joint_torque = vec![0.0; n];
        r.joint_torque(&torque, &mut joint_torque);
        r.motor_torque(&joint_torque, &mut back);
        assert!(difference(&back, &torque) < 1e-12);
        let power = |torque: &[f64], speed: &[f64]| -> f64 {
            torque.iter().zip(speed).map(|(torque, speed)| torque * speed).sum()
        };
        let (motors, joints) = (power(&torque, &motor_speed), power(&joint_torque, &dq));
        assert!(difference(&[motors], &[joints]) < 1e-12);
    }
}

#[test]
fn damaged_files_are_refused_and_never_panic() {
    let mut random = Random(7);
    for _ in 0..2000 {
        let mut bytes = TX40.as_bytes().to_vec();
        for _ in 0..1 + random.below(3) {
            let place = random.below(bytes.len());
            bytes[place] = u8::try_from(random.below(128)).unwrap();
        }
        let text = String::from_utf8_lossy(&bytes);
        if let Err(error) = Robot::from_toml(&text) {
            assert!(!error.to_string().is_empty());
        }
    }
}
