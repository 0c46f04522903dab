//! Experiments whose model is wrong, each in one way.

use didim_dynamics::robot::SignModel;
use didim_dynamics::simulation::{Stribeck, Unmodelled};
use didim_identification::identification::{Estimate, Experiment};
use didim_sim::{Payload, Scenario};

use super::cells::{Cell, Noise, Parameters};
use super::deviations::{Run, Summary};
use super::methods::{Method, methods};
use crate::common::experiment::{experiment, hold_ignored};
use crate::common::parallel::in_parallel;
use crate::common::table::{Column, Table, writing};

const SEEDS: usize = 3;

/// What the result can make of an error.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Expected {
    /// It is within what is taken for possible: nothing speaks against the result, and its combined
    /// uncertainty covers the truth.
    Covered,
    /// Something stated is contradicted, or the controller is not the recorded one: named.
    Refused,
    /// Beyond what is stated, and no data show it.
    Invisible,
}

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Wrong {
    Nothing,
    SignModel,
    Stribeck,
    GainOfJoint3,
    AllGains,
    Payload,
    PayloadAllParameters,
    Hold,
}

impl Wrong {
    const ALL: [Self; 8] = [
        Self::Nothing,
        Self::SignModel,
        Self::Stribeck,
        Self::GainOfJoint3,
        Self::AllGains,
        Self::Payload,
        Self::PayloadAllParameters,
        Self::Hold,
    ];

    fn expected(self, method: &Method) -> Expected {
        match self {
            Self::Nothing | Self::SignModel | Self::Stribeck | Self::Hold => Expected::Covered,
            // Who simulates the loop knows the controller, and what command it makes.
            Self::GainOfJoint3 | Self::AllGains if method.simulates => Expected::Refused,
            Self::GainOfJoint3 => Expected::Covered,
            // A payload is no parameter of the arm: 28 of 60 are those of the two together.
            Self::AllGains | Self::Payload | Self::PayloadAllParameters => Expected::Invisible,
        }
    }

    /// What a refusal, or what the data want most, has to speak of.
    fn named(self) -> &'static str {
        match self {
            Self::SignModel | Self::Stribeck => "friction law",
            Self::GainOfJoint3 => "torque gain of joint 3",
            Self::Payload => "parameters left out",
            Self::AllGains => "described controller of joint 1",
            Self::Nothing | Self::Hold | Self::PayloadAllParameters => "",
        }
    }

    /// The paper's arm at the low noise level, so that what is found is the error and hardly the
    /// noise.
    fn cell(self) -> Cell {
        let parameters = match self {
            Self::PayloadAllParameters => Parameters::Physical,
            _ => Parameters::Paper,
        };
        Cell { parameters, noise: Noise::Low, coloured: false }
    }

    fn description(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::SignModel => {
                "sign model: the arm has tanh(q̇/0.05), the model a dead band of 0.01"
            }
            Self::Stribeck => "Stribeck friction, fs = 0.1 fc, vs = 0.1 rad/s",
            Self::GainOfJoint3 => "gain of joint 3, 5 % too large",
            Self::AllGains => "all gains, 5 % too large",
            Self::Payload => "payload of 1 kg, 0.1 m from the flange, 28 parameters identified",
            Self::PayloadAllParameters => "the same payload, all 60 parameters identified",
            Self::Hold => "hold of the torque ignored",
        }
    }

    /// The arm with the error.
    fn scenario(self, seed: u64) -> Scenario {
        let scenario = self.cell().scenario(seed);
        let gain =
            |torque_gain| Unmodelled { torque_gain: Some(torque_gain), ..Default::default() };
        match self {
            Self::Nothing | Self::SignModel | Self::Hold => Ok(scenario),
            Self::Stribeck => {
                let of_joint = |joint: usize| Stribeck {
                    torque_nm: 0.1 * scenario.truth_of(&format!("fc{joint}")).unwrap(),
                    velocity_rad_s: 0.1,
                    sign_width_rad_s: 0.05,
                };
                let stribeck = Some((1..=6).map(of_joint).collect());
                scenario.with_unmodelled(Unmodelled { stribeck, ..Default::default() })
            }
            Self::GainOfJoint3 => {
                scenario.with_unmodelled(gain(vec![1.0, 1.0, 1.05, 1.0, 1.0, 1.0]))
            }
            Self::AllGains => scenario.with_unmodelled(gain(vec![1.05; 6])),
            // The flange is 0.065 m from the wrist's centre, where the last frame is.
            Self::Payload | Self::PayloadAllParameters => {
                scenario.with_payload(Payload::point_mass(1.0, [0.0, 0.0, 0.165]))
            }
        }
        .unwrap()
    }

    fn identify(self, method: &Method, scenario: &Scenario, experiment: &Experiment) -> Estimate {
        let robot = match self {
            Self::SignModel => {
                let dead_band = SignModel::DeadBand { threshold_rad_s: 0.01 };
                &scenario.robot().clone().with_sign_model(dead_band)
            }
            _ => scenario.robot(),
        };
        let parameters = self.cell().parameters;
        let (base, names) = (parameters.base(), parameters.names());
        (method.identify)(robot, &base, experiment, &names)
    }
}

/// What an error does to a method's estimates.
struct Effect {
    /// z of the parameter that is farthest off in any run.
    largest: (String, f64),
    relative_error: f64,
    /// Share of parameters within two combined uncertainties \[%\].
    covered: f64,
    applicable: usize,
    /// What the data want most in the first run.
    most_wanted: String,
    first_reason: Option<String>,
    /// The reasons of each run, in one text.
    reasons: Vec<String>,
}

impl Effect {
    fn new(estimates: &[&(Estimate, Run)]) -> Self {
        let deviations = estimates.iter().flat_map(|(_, run)| &run.deviations);
        let largest = deviations.max_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs())).unwrap();
        let relative = estimates.iter().map(|(estimate, _)| estimate.relative_error);
        let summary = Summary::new(estimates.iter().map(|(_, run)| run));
        Self {
            largest: largest.clone(),
            relative_error: relative.sum::<f64>() / estimates.len() as f64,
            covered: summary.within_2_combined,
            applicable: summary.applicable,
            most_wanted: estimates[0].0.nuisance_parameters[0].nuisance.to_string(),
            reasons: estimates
                .iter()
                .map(|(estimate, _)| {
                    let reasons = estimate.verdict.reasons.iter().map(ToString::to_string);
                    reasons.collect::<Vec<_>>().join("; ")
                })
                .collect(),
            first_reason: estimates.iter().find_map(|(estimate, _)| {
                estimate.verdict.reasons.first().map(ToString::to_string)
            }),
        }
    }
}

/// These errors by every method, all seeds together.
fn effects(wrongs: &[Wrong], methods: &[Method]) -> Vec<(Wrong, usize, Effect)> {
    let runs = in_parallel(wrongs.len() * SEEDS, |index| {
        let (wrong, seed) = (wrongs[index / SEEDS], index % SEEDS + 1);
        let scenario = wrong.scenario(seed as u64);
        let mut experiment = experiment(&scenario);
        if wrong == Wrong::Hold {
            experiment = hold_ignored(experiment);
        }
        methods
            .iter()
            .map(|method| {
                let estimate = wrong.identify(method, &scenario, &experiment);
                let run = Run::new(&estimate, &scenario);
                (estimate, run)
            })
            .collect::<Vec<_>>()
    });
    let mut effects = Vec::new();
    for (&wrong, runs) in wrongs.iter().zip(runs.chunks(SEEDS)) {
        for method in 0..methods.len() {
            let estimates: Vec<_> = runs.iter().map(|run| &run[method]).collect();
            effects.push((wrong, method, Effect::new(&estimates)));
        }
    }
    effects
}

/// What is wrong is within the combined uncertainty, or refused by its name, or beyond what is
/// stated and in no data. One of each, unless the table is written.
#[test]
fn errors_put_in_on_purpose_are_covered_or_named() {
    // The paper's position filter is an error of its own, and has its own table.
    let methods: Vec<Method> = methods().into_iter().filter(|method| !method.distorts).collect();
    let some = [Wrong::Stribeck, Wrong::GainOfJoint3, Wrong::AllGains, Wrong::Payload];
    let wrongs: &[Wrong] = if writing() { &Wrong::ALL } else { &some };
    let effects = effects(wrongs, &methods);
    let mut wrong_verdicts = Vec::new();
    for (wrong, method, effect) in &effects {
        let name = methods[*method].name;
        let right = match wrong.expected(&methods[*method]) {
            Expected::Covered => {
                let named = wrong.named();
                effect.applicable == SEEDS
                    && effect.covered >= 85.0
                    && effect.most_wanted.contains(named)
            }
            Expected::Refused => {
                effect.applicable == 0 && effect.reasons.iter().all(|r| r.contains(wrong.named()))
            }
            Expected::Invisible => effect.largest.1.abs() > 5.0,
        };
        if !right {
            wrong_verdicts.push(format!(
                "{wrong:?}, {name}: {} of {SEEDS} applicable, {:.0} % covered, {}, {:?}, {:?}",
                effect.applicable,
                effect.covered,
                effect.most_wanted,
                effect.largest,
                effect.first_reason
            ));
        }
    }
    let row = |(wrong, method, effect): &(Wrong, usize, Effect)| {
        vec![
            wrong.description().to_owned(),
            methods[*method].name.to_owned(),
            format!("{:.1} {}", effect.largest.1, effect.largest.0),
            match wrong.expected(&methods[*method]) {
                Expected::Covered => "covered",
                Expected::Refused => "refused",
                Expected::Invisible => "in no data",
            }
            .to_owned(),
            format!("{:.1}", effect.covered),
            format!("{:.2}", 100.0 * effect.relative_error),
            format!("{} of {SEEDS}", effect.applicable),
            effect.most_wanted.clone(),
            effect.first_reason.clone().unwrap_or_else(|| "none".to_owned()),
        ]
    };
    let columns = vec![
        Column::exact("what is wrong"),
        Column::exact("method"),
        // Deviations in σ reach hundreds.
        Column::share("largest z", 0.02),
        Column::exact("has to be"),
        Column::within("within 2 combined [%]", 0.05),
        Column::within("relative error [%]", 0.02),
        Column::exact("applicable"),
        Column::exact("wanted most"),
        Column::share("first reason", 0.02),
    ];
    let table = Table {
        document: "truth.md",
        name: "errors on purpose",
        columns,
        rows: effects.iter().map(row).collect(),
    };
    println!("{}", table.markdown());
    assert!(wrong_verdicts.is_empty(), "{}", wrong_verdicts.join("\n"));
    table.check_part(2);
}
