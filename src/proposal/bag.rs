//! `[data.bag]` of a ROS 2 bag: the joint states and their units.

use std::path::{Path, PathBuf};

use didim_dynamics::robot::Robot;
use didim_formats::{BagContents, BagSpec, BagTime, BagTopic, Side, read_bag};

use super::draft::Draft;
use super::evidence::{Evidence, ProposalError};
use super::plausible::{SignalSurvey, propose_torque_timing, round_rate};
use super::value::{Guess, SIDE_QUESTION, TORQUE_SIGN_QUESTION, TORQUE_UNIT_QUESTION, quote_text};

const SECTION_NAME: &str = "data.bag";
/// Range of plausible stamp rates of joint states \[Hz\].
const STAMPED_HZ: core::ops::Range<f64> = 1.0..20_000.0;

pub(super) fn propose(
    draft: &mut Draft<'_>,
    evidence: &Evidence,
    (file, contents): &(PathBuf, BagContents),
) -> Result<(), ProposalError> {
    let robot = &evidence.robot.robot;
    let mut joints: Vec<String> = evidence.robot.joint_names().map(str::to_owned).collect();
    let has_all = |topic: &BagTopic, joints: &[String]| {
        joints.iter().all(|joint| topic.joints.contains(joint))
    };
    let mut is_published =
        !joints.is_empty() && contents.topics.iter().any(|topic| has_all(topic, &joints));
    if let Some(named) = draft.answered_texts("data.bag.joints") {
        (joints, is_published) = (named, false);
    }
    check_names(file, contents)?;
    if !is_published {
        let joint_names: Vec<&str> =
            contents.topics.iter().flat_map(|topic| &topic.joints).map(String::as_str).collect();
        let question =
            format!("names in the messages, in the arm's order, of {}", joint_names.join(" "));
        draft.add_entry(SECTION_NAME, "joints", Guess::without_value(&question));
    }
    let fits = |topic: &&BagTopic| joints.len() == robot.joints() && has_all(topic, &joints);
    let mut fitting: Vec<&BagTopic> = contents.topics.iter().filter(fits).collect();
    // If a topic has several publishers, the one with the most messages is used.
    fitting.sort_by_key(|topic| core::cmp::Reverse(topic.messages));
    let mut names: Vec<&str> = Vec::new();
    fitting.retain(|topic| {
        let is_new = !names.contains(&topic.name.as_str());
        names.push(&topic.name);
        is_new
    });
    let answered = draft.answered_text("data.bag.topic");
    let topic = match (fitting.as_slice(), &answered) {
        ([one], None) => Some(*one),
        ([], None) => None,
        (several, answered) => {
            let names: Vec<&str> = several.iter().map(|topic| topic.name.as_str()).collect();
            let guess = Guess::without_value(&format!("one of {}", names.join(" ")));
            draft.add_entry(SECTION_NAME, "topic", guess);
            several.iter().find(|topic| Some(&topic.name) == answered.as_ref()).copied()
        }
    };
    let (time, rate_hz) = time_guess(topic);
    let rate = match rate_hz {
        Some(rate_hz) => Guess::from_file(
            format!("{:?}", round_rate(rate_hz)),
            "the mean distance of the messages",
        ),
        None => Guess::without_value("messages a second"),
    };
    draft.add_entry("data", "rate_hz", rate);
    draft.add_entry(SECTION_NAME, "time", time);
    draft.add_entry("data", "torque_valid", propose_torque_timing(false));
    let survey = survey_of_topic(file, robot, joints, topic)?;
    if survey.as_ref().is_some_and(|survey| survey.has_turns) {
        let wraps = Guess::assumed("true".into(), "positions jump by a turn");
        draft.add_entry(SECTION_NAME, "wraps", wraps);
    }
    let side = match &survey {
        Some(survey_input) if survey_input.may_be_of_joints() => {
            Guess::from_file(quote_text("joint"), "joint states, within the joints' limits")
        }
        Some(_) => Guess::without_value(&format!(
            "{SIDE_QUESTION}; some positions are beyond the joints' limits"
        )),
        None => Guess::without_value(SIDE_QUESTION),
    };
    draft.add_entry("data", "side", side);
    let survey_input = survey.filter(|_| draft.has_text("data.side", "joint"));
    let [unit, sign] = effort_guesses(survey_input.as_ref(), topic);
    draft.add_entry(SECTION_NAME, "effort.unit", unit);
    if draft.has_current("data.bag.effort.unit") {
        let question = "torque of one ampere on the joint side, one for all or a list [N·m/A]";
        draft.add_entry(SECTION_NAME, "effort.per_ampere", Guess::without_value(question));
    }
    draft.add_entry(SECTION_NAME, "effort.sign", sign);
    Ok(())
}

/// Refuses joint states of which none names a joint.
fn check_names(file: &Path, contents: &BagContents) -> Result<(), ProposalError> {
    let is_nameless = contents.topics.iter().all(|topic| topic.joints.is_empty());
    match contents.topics.first().filter(|_| is_nameless) {
        Some(topic) => {
            Err(ProposalError::NoJointNames { file: file.to_path_buf(), topic: topic.name.clone() })
        }
        None => Ok(()),
    }
}

/// Proposes the clock of the samples. Also returns the rate by this clock \[messages/s\].
fn time_guess(topic: Option<&BagTopic>) -> (Guess, Option<f64>) {
    match topic {
        Some(BagTopic { header_hz: Some(rate_hz), .. }) if STAMPED_HZ.contains(rate_hz) => (
            Guess::from_file(quote_text("header"), "the stamps in the messages advance"),
            Some(*rate_hz),
        ),
        Some(BagTopic { log_hz: Some(rate_hz), .. }) if STAMPED_HZ.contains(rate_hz) => (
            Guess::assumed(
                quote_text("log"),
                "time of recording: the stamps in the messages do not advance",
            ),
            Some(*rate_hz),
        ),
        Some(_) => (
            Guess::assumed(
                quote_text("rows"),
                "neither the stamps nor the recording times advance at a constant rate",
            ),
            None,
        ),
        None => (Guess::without_value("\"header\", \"log\" or \"rows\": the time to use"), None),
    }
}

/// Reads the joint states of a topic, if its messages have an effort for every joint.
fn survey_of_topic<'r>(
    file: &Path,
    robot: &'r Robot,
    joints: Vec<String>,
    topic: Option<&BagTopic>,
) -> Result<Option<SignalSurvey<'r>>, ProposalError> {
    let survey = match topic {
        Some(topic) if topic.without_effort.iter().all(|joint| !joints.contains(joint)) => {
            let spec = BagSpec {
                joints,
                topic: Some(topic.name.clone()),
                rate_hz: 1.0,
                side: Side::Joint,
                torque_scales: vec![1.0; robot.joints()],
                wraps: Vec::new(),
                time: BagTime::Rows,
            };
            let measurement = read_bag(file, &spec)?.into_whole();
            measurement.map(|all| SignalSurvey {
                robot,
                position: all.signals.position_rad,
                torque: all.signals.torque_nm,
                has_turns: false,
            })
        }
        _ => None,
    };
    Ok(survey.map(|raw| raw.in_si(&quote_text("rad"), None).unwrap_or(raw)))
}

/// Proposes the unit and the sign of the efforts.
fn effort_guesses(survey: Option<&SignalSurvey<'_>>, topic: Option<&BagTopic>) -> [Guess; 2] {
    match survey {
        Some(survey) => survey.torque(None),
        None if topic.is_some_and(|topic| !topic.without_effort.is_empty()) => [
            Guess::without_value(
                "messages lack the effort of a joint, so nothing can be identified; record the \
                    efforts of the drives",
            ),
            Guess::without_value("1 or -1"),
        ],
        None => {
            [Guess::without_value(TORQUE_UNIT_QUESTION), Guess::without_value(TORQUE_SIGN_QUESTION)]
        }
    }
}
