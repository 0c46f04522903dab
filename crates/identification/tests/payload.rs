//! A load on the last link of arms that are known as well as an identification knows them.

use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::{JointIndex, NamedFrame, ParameterKind};
use didim_identification::feasibility::Body;
use didim_identification::identification::{
    DeclaredLoad, Experiment, KnownArm, KnownModel, Method, ModelUncertainty, Options,
    ParameterCovariance, Payload, PayloadError, PayloadLimits, Presence, UncertainValue,
    filtered_motion, find_payload, identify,
};
use nalgebra::{DMatrix, Matrix3, Matrix4, Rotation3, Vector3};

use crate::arms::{Design, Random as OfDesigns, TX40};
use crate::common::arm::{Arm, Random, options, signals};

const RATE_HZ: f64 = 200.0;
const SAMPLES: usize = 3000;

/// An arm, as an identification of it without load knows it.
struct Example {
    arm: Arm,
    random: Random,
    options: Options,
    parameters: Vec<(String, f64)>,
    covariance: DMatrix<f64>,
    uncertainty: Option<ModelUncertainty>,
    /// Frame in which the load is described; that of the model without one.
    frame: Option<NamedFrame>,
}

/// Torques along a motion are those of these standard parameters, with noise of so much of each
/// joint's. Joints may stand still from one on, with a torque that friction holds.
fn record(
    arm: &Arm,
    random: &mut Random,
    standard: &[f64],
    noise: f64,
    still: Option<(usize, f64)>,
) -> Experiment {
    let mut position = arm.positions(random, SAMPLES, RATE_HZ, 2.0);
    let (first, held_nm) = still.unwrap_or((position.len(), 0.0));
    position[first..].iter_mut().for_each(|joint| joint.fill(0.4));
    let silent = signals(RATE_HZ, position.clone(), position.clone());
    let silent = Experiment::joint_side(&silent).unwrap();
    let motion =
        filtered_motion(&arm.robot, &silent, &options(20.0, 0.8, 10).position_filter).unwrap();
    let mut torques = arm.torques_of(standard, &motion);
    for torque in &mut torques {
        let square: f64 = torque.iter().map(|tau| tau * tau).sum();
        let level = noise * (square / SAMPLES as f64).sqrt();
        torque.iter_mut().for_each(|tau| *tau += level * random.normal());
    }
    torques[first..].iter_mut().flatten().for_each(|tau| *tau += held_nm);
    Experiment::joint_side(signals(RATE_HZ, position, torques)).unwrap()
}

impl Example {
    fn identified(arm: Arm, mut random: Random, noise: f64) -> Self {
        let options = options(20.0, 0.8, 10);
        let record = record(&arm, &mut random, &arm.truth, noise, None);
        let identified =
            identify(Method::IdimLs, &arm.robot, &arm.base, &record, &options).unwrap();
        let estimate = identified.estimate;
        let covariance = estimate.covariance.unwrap().matrix(estimate.parameters.len()).unwrap();
        let parameters = estimate.parameters.iter().map(|p| (p.name.clone(), p.value)).collect();
        let uncertainty = estimate.model_uncertainty;
        Self { arm, random, options, parameters, covariance, uncertainty, frame: None }
    }

    /// To all digits.
    fn exact(arm: Arm, random: Random) -> Self {
        let parameters: Vec<(String, f64)> =
            arm.base.names().iter().cloned().zip(arm.true_base()).collect();
        let covariance = DMatrix::identity(parameters.len(), parameters.len()) * 1e-24;
        let options = options(20.0, 0.8, 10);
        Self { arm, random, options, parameters, covariance, uncertainty: None, frame: None }
    }

    /// The arm with this body on its last link.
    fn standard_with(&self, body: &Body) -> Vec<f64> {
        let mut standard = self.arm.truth.clone();
        let last = self.arm.robot.joints() - 1;
        for (kind, value) in ParameterKind::LINK.iter().zip(body.parameters()) {
            standard[self.arm.robot.parameters().column(*kind, JointIndex::new(last)).unwrap()] +=
                value;
        }
        standard
    }

    fn try_find(
        &self,
        record: &Experiment,
        declared: DeclaredLoad,
    ) -> Result<Payload, PayloadError> {
        let Self { arm, options, parameters, covariance, uncertainty, .. } = self;
        let parameters: Vec<(&str, f64)> =
            parameters.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        let model = KnownModel {
            parameters: &parameters,
            fixed_parameters: &[],
            uncertainty: uncertainty.as_ref(),
        };
        let covariance = ParameterCovariance::from_symmetric(covariance);
        let arm_found = KnownArm { model, covariance: Some(&covariance) };
        let frame = self.frame.as_ref().map_or_else(|| arm.robot.model_frame(), Clone::clone);
        find_payload(&arm.robot, &arm.base, record, options, arm_found, declared, &frame)
    }

    fn find(&self, record: &Experiment) -> Payload {
        self.try_find(record, DeclaredLoad::default()).unwrap()
    }

    /// A record with this body, 2 % of the torque noise.
    fn record(&mut self, body: &Body) -> Experiment {
        let standard = self.standard_with(body);
        record(&self.arm, &mut self.random, &standard, 0.02, None)
    }
}

fn tx40(seed: u64) -> Example {
    Example::identified(Arm::nominal(TX40), Random(seed), 0.02)
}

fn random_arm(seed: u64) -> (Arm, Random) {
    let mut random = Random(seed);
    let arm = Arm::random(&mut random, 7);
    (arm, random)
}

fn seven(seed: u64) -> Example {
    let (arm, random) = random_arm(seed);
    Example::identified(arm, random, 0.02)
}

/// A body of 0.1 m to 0.3 m somewhere before the flange.
fn block(random: &mut Random, mass_kg: f64) -> Body {
    let c = Vector3::from_fn(|_, _| random.uniform(-0.1, 0.1)) + Vector3::z() * 0.1;
    let extent = Vector3::from_fn(|_, _| random.uniform(0.1, 0.3).powi(2) / 12.0);
    let second = Matrix3::from_diagonal(&extent) + c * c.transpose();
    let mut pseudo = Matrix4::zeros();
    pseudo.fixed_view_mut::<3, 3>(0, 0).copy_from(&second);
    pseudo.fixed_view_mut::<3, 1>(0, 3).copy_from(&c);
    pseudo.fixed_view_mut::<1, 3>(3, 0).copy_from(&c.transpose());
    pseudo[(3, 3)] = 1.0;
    Body::from_pseudo_inertia(&(pseudo * mass_kg))
}

/// The mass whose torques are this share of the arm's \[kg\].
fn mass_of_share(example: &Example, share: f64) -> f64 {
    let mut random = Random(1);
    let motion = example.arm.motion(&mut random, 500, RATE_HZ, 2.0);
    fn square(
        standard: &[f64],
        motion: &didim_identification::identification::Motion,
        example_arm: &Arm,
    ) -> f64 {
        let torques = example_arm.torques_of(standard, motion);
        torques.iter().flatten().map(|tau| tau * tau).sum::<f64>()
    }
    let mut alone = example.standard_with(&block(&mut random, 1.0));
    alone.iter_mut().zip(&example.arm.truth).for_each(|(of, arm)| *of -= arm);
    share
        * (square(&example.arm.truth, &motion, &example.arm)
            / square(&alone, &motion, &example.arm))
        .sqrt()
}

/// xx xy xz yy yz zz
fn entries(inertia: &Matrix3<f64>) -> [f64; 6] {
    [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|at| inertia[at])
}

/// How far what is found is from the body, in its standard deviations: of mass, centre, inertia and
/// the parameters.
fn deviations(found: &Payload, body: &Body) -> Vec<f64> {
    let (c, i) = (body.centre_of_mass_m().unwrap(), body.inertia_about_centre().unwrap());
    let i = entries(&i);
    let load = &found.load;
    let mass = [(load.mass_kg, body.mass_kg)];
    let centre = load.centre_m.into_iter().zip(c.iter().copied());
    let deviations = mass.into_iter().chain(centre).chain(load.inertia_kg_m2.into_iter().zip(i));
    deviations.filter_map(|(found, truth)| Some(found?.deviations_from(truth))).collect()
}

#[test]
fn a_payload_comes_back_within_its_uncertainty() {
    for mut example in [tx40(1), seven(2)] {
        for share in [0.001, 0.01, 0.1] {
            let mass = mass_of_share(&example, share);
            let body = block(&mut example.random, mass);
            let record = example.record(&body);
            let payload = example.find(&record);
            let off = deviations(&payload, &body);
            assert!(off.iter().all(|of| of.abs() < 4.5), "{off:?}");
            assert_eq!(payload.parameters.len(), 10);
            assert!(payload.after.relative_error <= payload.before.relative_error);
            if share > 0.05 {
                let Payload { presence, body: Some(possible), .. } = &payload else { panic!() };
                assert!(
                    presence.mass_deviations.unwrap() > 10.0
                        && presence.from_none.probability < 1e-9
                );
                assert!((possible.mass_kg / mass - 1.0).abs() < 0.2, "{possible:?}");
            }
        }
    }
}

#[test]
fn without_noise_it_is_found_exactly() {
    // One with friction that grows with what it carries.
    let (loaded, mut random) = random_arm(4);
    let loaded = (loaded.with_load_friction(&mut random), random);
    for (arm, mut random) in [(Arm::nominal(TX40), Random(3)), random_arm(4), loaded] {
        let body = block(&mut random, 1.3);
        let case = Example::exact(arm, random);
        let standard = case.standard_with(&body);
        let record = record(&case.arm, &mut Random(5), &standard, 0.0, None);
        let payload = case.find(&record);
        let (load, possible) = (&payload.load, payload.body.clone().unwrap());
        let centre = body.centre_of_mass_m().unwrap();
        assert!((load.mass_kg.unwrap().value - 1.3).abs() < 1e-6, "{load:?}");
        for k in 0..3 {
            assert!((load.centre_m[k].unwrap().value - centre[k]).abs() < 1e-6, "{load:?}");
        }
        let inertia = body.inertia_about_centre().unwrap();
        assert!((load.inertia_kg_m2[4].unwrap().value - inertia[(1, 2)]).abs() < 1e-6, "{load:?}");
        assert!(possible.is_the_estimate && possible.cost == 0.0, "{possible:?}");
        assert!(payload.presence.seen && payload.after.relative_error < 1e-6);
    }
}

/// A frame in any direction.
fn frame_anywhere(random: &mut Random) -> NamedFrame {
    let angles = [(); 3].map(|()| random.uniform(-3.0, 3.0));
    let rotation = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
    NamedFrame {
        name: "tool0".into(),
        origin_m: [(); 3].map(|()| random.uniform(-0.3, 0.3)),
        axes: [0, 1, 2].map(|k| rotation.matrix().column(k).into_owned().into()),
    }
}

/// The centre in a frame is that of the same body, also where an arm of few joints shows only sums
/// of its parameters; every value that has a frame of its own is as far from the truth as before.
#[test]
fn a_load_comes_back_in_the_frame_of_a_link() {
    let mut centres = 0;
    for joints in 1..=6 {
        let mut random = Random(40 + joints as u64);
        let arm = Arm::random(&mut random, joints);
        let body = block(&mut random, 1.3);
        let frame = frame_anywhere(&mut random);
        let mut case = Example::exact(arm, random);
        case.frame = Some(frame.clone());
        let standard = case.standard_with(&body);
        let record = record(&case.arm, &mut Random(5), &standard, 0.0, None);
        let centre = body.centre_of_mass_m().unwrap().into();
        let declared = DeclaredLoad { mass_kg: Some(1.3), centre_m: Some(centre) };
        let payload = case.try_find(&record, declared).unwrap();
        let own = payload.in_frame.as_ref().unwrap();
        assert_eq!(
            (own.centre.frame.as_str(), own.parameters.len()),
            ("tool0", payload.parameters.len())
        );
        let truth = frame.point_in_frame(centre);
        for (found, truth) in own.centre.centre_m.iter().zip(truth) {
            let Some(found) = found else { continue };
            assert!((found.value - truth).abs() < 1e-6, "{joints}: {found:?} {truth}");
            centres += 1;
        }
        let in_frame = frame.inverse().parameters_in_link(body.parameters());
        let kinds = ["xx", "xy", "xz", "yy", "yz", "zz", "mx", "my", "mz", "m"];
        for (kind, truth) in kinds.iter().zip(in_frame) {
            let Some(alone) = own.parameters.iter().find(|of| of.name == *kind) else { continue };
            assert!((alone.found.value - truth).abs() < 1e-6, "{joints}: {alone:?} {truth}");
        }
        if let Some(compared) = &payload.declared
            && compared.together.degrees_of_freedom == 4
        {
            assert_eq!(own.declared.as_ref().unwrap().together.degrees_of_freedom, 4);
        }
        let Some(possible) = &own.body else { continue };
        let back = frame.point_in_link(possible.centre_m);
        let internal = payload.body.as_ref().unwrap().centre_m;
        assert!(back.iter().zip(internal).all(|(one, other)| (one - other).abs() < 1e-9));
    }
    assert!(centres >= 9, "{centres}");
}

/// Of z² over these fixed seeds the root of the mean is that of right standard deviations, here to
/// a third.
#[test]
fn standard_deviations_are_those_of_the_error() {
    for (arm, _) in [(Arm::nominal(TX40), ()), (random_arm(2).0, ())] {
        let mut squares = Vec::new();
        for seed in 0..6 {
            let mut case = Example::identified(arm.clone(), Random(100 + seed), 0.02);
            let mass = mass_of_share(&case, 0.05);
            let body = block(&mut case.random, mass);
            let record = case.record(&body);
            let off = deviations(&case.find(&record), &body);
            squares.extend(off.iter().map(|z| z * z));
        }
        let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((0.67..1.5).contains(&rms), "{rms} of {}", squares.len());
    }
}

/// Noted payloads of the arm and of a record may be the same, or less than before.
#[test]
fn no_more_or_less_than_with_the_result_may_be_declared() {
    let mut case = tx40(3);
    let record = case.record(&Body::from_parameters([0.0; 10]));
    for mass_kg in [0.0, -2.0] {
        let declared = DeclaredLoad { mass_kg: Some(mass_kg), centre_m: None };
        let payload = case.try_find(&record, declared).unwrap();
        assert!(payload.body.is_none() && !payload.presence.seen);
        assert_eq!(payload.declared.unwrap().within, mass_kg == 0.0, "{mass_kg}");
    }
}

#[test]
fn no_load_is_called_so_and_limited() {
    let mut case = tx40(7);
    let arm = case.arm.truth.clone();
    let empty = record(&case.arm, &mut case.random, &arm, 0.02, None);
    let payload = case.find(&empty);
    let sigma = payload.load.mass_kg.unwrap().standard_deviation;
    let limit = payload.presence.mass_limit_kg.unwrap();
    assert!(
        !payload.presence.seen
            && !payload.presence.from_none.is_significant(&PayloadLimits::default())
    );
    assert!(limit > 0.0 && limit < 6.0 * sigma, "{limit} {sigma}");
    assert_eq!((payload.load.centre_m, payload.body.as_ref()), ([None; 3], None));
    // A stated mass below what can be seen still agrees, and has a body to look for.
    let declared = DeclaredLoad { mass_kg: Some(sigma), centre_m: Some([0.0, 0.0, 0.05]) };
    let payload = case.try_find(&empty, declared).unwrap();
    assert!(payload.declared.unwrap().within && payload.body.unwrap().mass_kg > 0.0);
}

/// The other way round: identified with a load that is gone.
#[test]
fn a_negative_mass_is_none() {
    let Example { mut random, arm, .. } = tx40(17);
    let body = block(&mut random, 1.0);
    let mut carrying = arm.clone();
    carrying.truth = Example::exact(arm.clone(), Random(0)).standard_with(&body);
    let empty = arm.truth;
    let mut case = Example::identified(carrying, Random(18), 0.02);
    let record = record(&case.arm, &mut case.random, &empty, 0.02, None);
    let payload = case.find(&record);
    let Presence { seen, mass_deviations, mass_limit_kg, from_none } = payload.presence;
    assert!(
        !seen
            && mass_deviations.unwrap() < -10.0
            && from_none.is_significant(&PayloadLimits::default())
    );
    assert_eq!((mass_limit_kg, payload.body), (None, None));
}

/// A gain that is uncertain by a per cent, and no motion tells, is in the mass where the result
/// says so.
#[test]
fn what_the_model_takes_for_known_is_in_the_uncertainty() {
    let mut case = tx40(19);
    let mass = mass_of_share(&case, 1.0);
    let body = block(&mut case.random, mass);
    let record = case.record(&body);
    let payload = case.find(&record);
    fn relative(found: &Payload) -> f64 {
        let mass = found.load.mass_kg.unwrap();
        mass.standard_deviation / mass.value
    }
    assert!(payload.with_model_errors && (0.01..0.03).contains(&relative(&payload)), "{payload:?}");
    case.uncertainty = None;
    let without = case.find(&record);
    assert!(!without.with_model_errors && relative(&without) < 0.005, "{without:?}");
}

#[test]
fn what_is_declared_is_held_against_it() {
    let mut case = seven(9);
    let body = block(&mut case.random, 2.0);
    let record = case.record(&body);
    let centre: [f64; 3] = body.centre_of_mass_m().unwrap().into();
    fn compared(
        mass_kg: Option<f64>,
        centre_m: Option<[f64; 3]>,
        case: &Example,
        record: &Experiment,
    ) -> (UncertainValue, Option<didim_identification::identification::Comparison>) {
        let payload = case.try_find(record, DeclaredLoad { mass_kg, centre_m }).unwrap();
        (payload.load.mass_kg.unwrap(), payload.declared)
    }
    let (mass, right) = compared(Some(2.0), Some(centre), &case, &record);
    let right = right.unwrap();
    assert!(right.within && right.together.degrees_of_freedom == 4, "{right:?}");
    let off = mass.deviations_from(2.0);
    assert!((right.mass_deviations.unwrap() - off).abs() < 1e-9);
    let (_, heavy) = compared(Some(2.0 - 10.0 * mass.standard_deviation), None, &case, &record);
    let heavy = heavy.unwrap();
    assert!(!heavy.within && (heavy.mass_deviations.unwrap() - off - 10.0).abs() < 1e-6);
    assert_eq!(heavy.centre_deviations, [None; 3]);
    // A centre alone goes with any mass.
    let shifted = [centre[0] + 0.02, centre[1], centre[2]];
    assert!(compared(None, Some(centre), &case, &record).1.unwrap().within);
    let displaced = compared(None, Some(shifted), &case, &record).1.unwrap();
    assert!(!displaced.within && displaced.centre_deviations[0].unwrap() < -5.0, "{displaced:?}");
    assert_eq!(compared(None, None, &case, &record).1, None);
}

/// While joints stand still, some of the ten act together with others; and what those joints
/// measure counts nothing.
#[test]
fn what_a_record_does_not_show_is_named() {
    let mut count = 0;
    for first in [1, 2, 3] {
        let mut case = tx40(11);
        let body = block(&mut case.random, 1.0);
        let standard = case.standard_with(&body);
        let seed = case.random.0;
        let [found, loaded] = [0.0, 20.0].map(|held_nm| {
            let mut random = Random(seed);
            let still = record(&case.arm, &mut random, &standard, 0.02, Some((first, held_nm)));
            case.find(&still)
        });
        for (found, fixed_value) in found.parameters.iter().zip(&loaded.parameters) {
            let off = fixed_value.found.deviations_from(found.found.value);
            assert!(off.abs() < 0.02, "{}: {off}", found.name);
        }
        assert_eq!(found.standing, (first..6).map(JointIndex::new).collect::<Vec<_>>());
        assert!(found.without_effect.is_empty(), "{found:?}");
        assert_eq!(found.parameters.len() < 10, !found.not_identifiable.is_empty(), "{found:?}");
        assert!(first > 1 || found.parameters.len() < 10, "{found:?}");
        let symbols = ["xx", "xy", "xz", "yy", "yz", "zz"];
        for (symbol, entry) in symbols.iter().zip(found.load.inertia_kg_m2) {
            assert!(
                entry.is_none() || !found.not_identifiable.contains(symbol),
                "{symbol}: {found:?}"
            );
        }
        let off = deviations(&found, &body);
        println!("{first}: {:?}, {off:?}", found.not_identifiable);
        assert!(off.iter().all(|of| of.abs() < 4.5), "{off:?}");
        count += off.len();
    }
    assert!(count > 0);
}

/// A planar arm with its axes along gravity feels no height and no weight.
#[test]
fn what_an_arm_cannot_show_is_named() {
    let mut random = Random(13);
    let mut design = Design::random(&mut OfDesigns(0));
    design.gravity = [0.0, 0.0, -9.81];
    design.joints = vec![(false, [0.0; 4], true), (false, [0.0, 0.5, 0.0, 0.0], true)];
    design.rows = vec![vec![50.0, 0.0], vec![0.0, 50.0]];
    design.friction = [false; 3];
    design.own_friction = vec![None; 2];
    let mut arm = Arm::random(&mut random, 2);
    arm.robot = design.robot();
    arm.model = Model::new(&arm.robot);
    arm.base = BaseParameters::compute(&arm.model).unwrap();
    arm.truth = vec![1.0; arm.robot.parameters().names().len()];
    let mut case = Example::identified(arm, random, 0.02);
    let body = block(&mut case.random, 2.0);
    let record = case.record(&body);
    let payload = case.find(&record);
    assert_eq!(payload.without_effect, ["xx", "xy", "xz", "yy", "yz", "mz"]);
    let names: Vec<&str> = payload.parameters.iter().map(|of| of.name.as_str()).collect();
    assert_eq!(names, ["zz", "mx", "my", "m"]);
    assert!(payload.load.centre_m[2].is_none() && payload.load.centre_m[0].is_some());
    let identifiable: Vec<bool> = payload.load.inertia_kg_m2.iter().map(Option::is_some).collect();
    assert_eq!(identifiable, [false, false, false, false, false, true]);
    let off = deviations(&payload, &body);
    assert!(off.iter().all(|of| of.abs() < 4.5), "{off:?}");
}

#[test]
fn an_arm_that_is_not_known_is_refused() {
    let mut case = tx40(15);
    let body = block(&mut case.random, 1.0);
    let record = case.record(&body);
    let covariance = case.covariance.clone();
    let refused =
        |known_part: &Example| known_part.try_find(&record, DeclaredLoad::default()).unwrap_err();
    case.covariance =
        covariance.view((1, 1), (covariance.nrows() - 1, covariance.ncols() - 1)).into_owned();
    assert_eq!(refused(&case), PayloadError::NoCovariance);
    case.covariance = -covariance.clone();
    assert_eq!(refused(&case), PayloadError::Covariance);
    // The first is of the first link, which no load changes; the weight of the last one is.
    let count = case.parameters.len() - 1;
    case.covariance = covariance.view((0, 0), (count, count)).into_owned();
    let left_out = case.parameters.iter().position(|(name, _)| name == "my6").unwrap();
    case.parameters.remove(left_out);
    assert_eq!(refused(&case), PayloadError::NotIdentified { names: vec!["my6".to_owned()] });
}

/// What an identification and a record with 2 % of noise tell of loads: by hand, see
/// docs/evidence/models.md.
#[test]
#[ignore = "needs minutes: tests/run full"]
fn payload_study() {
    println!(
        "| arm | torque of the load | mass | σ of mass | error of mass | of centre | of inertia | \
        rms z | seen | possible as found |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for (name, arm) in [("TX40", Arm::nominal(TX40)), ("7 axes", random_arm(2).0)] {
        for share in [0.001, 0.01, 0.1] {
            let mut study = Study::default();
            for seed in 0..40 {
                let mut case = Example::identified(arm.clone(), Random(1000 + seed), 0.02);
                let mass = mass_of_share(&case, share);
                let body = block(&mut case.random, mass);
                let record = case.record(&body);
                study.add(&case.find(&record), &body);
            }
            study.print(name, share);
        }
    }
}

/// Errors of a cell of the study.
#[derive(Default)]
struct Study {
    z: Vec<f64>,
    mass: Vec<f64>,
    mass_kg: f64,
    sigma: Vec<f64>,
    centre: Vec<f64>,
    inertia: Vec<f64>,
    seen: usize,
    as_found: usize,
    records: usize,
}

impl Study {
    fn add(&mut self, found: &Payload, body: &Body) {
        let centre = body.centre_of_mass_m().unwrap();
        let inertia = entries(&body.inertia_about_centre().unwrap());
        let load = &found.load;
        let mass = load.mass_kg.unwrap();
        self.mass_kg = body.mass_kg;
        self.records += 1;
        self.mass.push(mass.value - body.mass_kg);
        self.sigma.push(mass.standard_deviation);
        let off = |(found, truth): (Option<UncertainValue>, f64)| Some(found?.value - truth);
        self.centre.extend(load.centre_m.into_iter().zip(centre.iter().copied()).filter_map(off));
        self.inertia.extend(load.inertia_kg_m2.into_iter().zip(inertia).filter_map(off));
        self.seen += usize::from(found.presence.seen);
        self.as_found += usize::from(found.body.as_ref().is_some_and(|of| of.is_the_estimate));
        // All ten, seen or not.
        self.z.extend(found.parameters.iter().zip(body.parameters()).map(|(of, truth)| {
            assert_eq!(found.parameters.len(), 10);
            of.found.deviations_from(truth)
        }));
    }

    fn print(&self, name: &str, share: f64) {
        let rms = |of: &[f64]| (of.iter().map(|x| x * x).sum::<f64>() / of.len() as f64).sqrt();
        println!(
            "| {name} | {} % | {:.4} kg | {:.1} g | {:.1} g | {:.2} mm | {:.2} g·m² | {:.2} | {} \
            of {} | {} |",
            100.0 * share,
            self.mass_kg,
            1e3 * rms(&self.sigma),
            1e3 * rms(&self.mass),
            1e3 * rms(&self.centre),
            1e3 * rms(&self.inertia),
            rms(&self.z),
            self.seen,
            self.records,
            self.as_found,
        );
    }
}
