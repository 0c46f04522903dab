//! Compilation of a specification and a DBC file to a plan.

use didim_dynamics::MAX_JOINTS;

use super::dbc::{Database, SignalFormat};
use super::error::LayoutError;
use super::field::Encoding;
use super::plan::{CompiledLayout, Extraction, MessagePlan, Quantity, Role, SampledBy, Validity};
use super::readings::{in_own_unit, law_signals, reading_specs};
use super::spec::{
    CyclesBy, FollowingErrorSign, LayoutSpec, PositionValidity, ReferenceSpec, ReferenceValidity,
    SignalNames, TorqueValidity,
};

/// The shortest and the longest accepted nominal period \[µs\].
const PERIOD_US: (f64, f64) = (10.0, 1e6);

impl CompiledLayout {
    /// Compiles the text of a DBC file and a specification to a plan.
    ///
    /// # Errors
    /// [`LayoutError`] names the mismatch and its place.
    pub fn compile(dbc: &str, spec: &LayoutSpec) -> Result<Self, LayoutError> {
        if !spec.nodes.is_empty() {
            return key_error("nodes", "names device files; give them or `dbc`, not both".into());
        }
        if !spec.slaves.is_empty() {
            return key_error("slaves", "are of an ENI file or a start-up, not of `dbc`".into());
        }
        check_no_objects(spec)?;
        let patterns = name_patterns(spec)?;
        // A pattern is expanded once per axis. So first check that an arm can have this number of
        // axes.
        check_axes(spec)?;
        let database = Database::parse(dbc)?;
        let mut messages = Vec::new();
        if let Some(name) = &spec.sync {
            let format = database.message("sync", name)?;
            messages.push(MessagePlan {
                format,
                role: Role::Sync,
                extractions: Vec::new(),
                excluded_values: Vec::new(),
                selector: None,
            });
        }
        for (key, quantity, names) in patterns {
            for (axis, name) in names_of(key, &names, spec.axes)?.iter().enumerate() {
                add_message(&database, &mut messages, key, name, quantity, axis)?;
            }
        }
        for except in &spec.except {
            for name in names_of("except", &except.signal, spec.axes)? {
                except_in(&database, &mut messages, &name, &except.is)?;
            }
        }
        if let Some(pattern) = &spec.counter {
            if spec.sync.is_some() {
                return key_error(
                    "counter",
                    "is for packed frames; with `sync` there are none".into(),
                );
            }
            add_message(&database, &mut messages, "counter", pattern, Quantity::Counter, 0)?;
        }
        finish(messages, spec)
    }
}

fn check_axes(spec: &LayoutSpec) -> Result<(), LayoutError> {
    if (1..=MAX_JOINTS).contains(&spec.axes) {
        return Ok(());
    }
    key_error("axes", format!("{}; an arm has 1 to {MAX_JOINTS}", spec.axes))
}

/// Completes the plan from its messages; any kind of description can give them.
pub(super) fn finish(
    mut messages: Vec<MessagePlan>,
    spec: &LayoutSpec,
) -> Result<CompiledLayout, LayoutError> {
    check_axes(spec)?;
    let period_ns = period_ns(spec)?;
    check_overlaps(&messages)?;
    let next_sync = spec.reference.as_ref().is_some_and(|r| r.valid == ReferenceValidity::NextSync);
    for message in &mut messages {
        if message.role != Role::Sample {
            continue;
        }
        let is_reading = |e: &Extraction| matches!(e.quantity, Quantity::Reading(_));
        let mut others = message.extractions.iter().filter(|e| !is_reading(e)).peekable();
        if others.peek().is_none() {
            message.role = Role::Reading;
        } else if others.all(|e| e.quantity == Quantity::Reference) {
            message.role = Role::Target;
        }
    }
    check_sync(&messages, spec)?;
    let needed = || messages.iter().filter(|message| message.role != Role::Reading);
    let sampled_by = if messages.iter().any(|message| message.role == Role::Sync) {
        SampledBy::Sync
    } else if needed().count() == 1 {
        SampledBy::Packed
    } else {
        let names: Vec<_> = needed().map(|m| m.format.name.as_str()).collect();
        let reason = format!(
            "missing: the signals are in several messages ({}), so that a message of the bus has \
             to mark the instant of the sample",
            names.join(", ")
        );
        return key_error("sync", reason);
    };
    let timing = spec.torque.valid.timing(1e9 / period_ns);
    let validity = Validity {
        at_arrival: at_arrival(spec),
        torque: timing.or_else(|problem| key_error("torque.valid", problem))?,
        reference_at_next_sync: next_sync,
        following_error: following_error(spec)?,
        enabled_value: spec.enabled.as_ref().map_or(0, |enabled| enabled.is),
    };
    let counting = spec.cycles_by;
    Ok(CompiledLayout::new(messages, sampled_by, spec.axes, period_ns, validity, counting))
}

/// Returns true if signals are valid at the arrival of their own frames.
pub(super) fn at_arrival(spec: &LayoutSpec) -> bool {
    spec.position.valid == PositionValidity::Arrival
}

/// Returns the sign convention if the references are following errors. A following error relates to
/// the position in the same cycle.
fn following_error(spec: &LayoutSpec) -> Result<Option<FollowingErrorSign>, LayoutError> {
    let Some(ReferenceSpec { following_error: Some(error), valid, .. }) = &spec.reference else {
        return Ok(None);
    };
    if *valid == ReferenceValidity::NextSync {
        let reason = "\"next-sync\" is of a target; a following error belongs to the position in \
            the same frame";
        return key_error("reference.valid", reason.into());
    }
    Ok(Some(*error))
}

/// Checks that the SYNC is compatible with signals that are valid at their own arrival.
fn check_sync(messages: &[MessagePlan], spec: &LayoutSpec) -> Result<(), LayoutError> {
    let arrival = at_arrival(spec);
    let agrees = |key, other: Option<bool>| match other {
        Some(other) if other != arrival => key_error(
            key,
            "either every signal is valid at the \"arrival\" of its own frame, or none is".into(),
        ),
        _ => Ok(()),
    };
    agrees("torque.valid", Some(spec.torque.valid == TorqueValidity::Arrival))?;
    let reference = spec.reference.as_ref();
    agrees("reference.valid", reference.map(|r| r.valid == ReferenceValidity::Arrival))?;
    let sync = messages.iter().find(|message| message.role == Role::Sync);
    if !arrival {
        return match sync.and_then(|sync| sync.extractions.first()) {
            Some(signal) => key_error(
                "sync",
                format!(
                    "carries `{}`, and a SYNC carries no signals; where every signal is valid at \
                     the arrival of its own frame, say `valid = \"arrival\"`",
                    signal.signal.name
                ),
            ),
            None => Ok(()),
        };
    }
    if sync.is_none() {
        let reason = "missing: signals are valid at the arrival of their own frames, so that a \
            message that comes once a cycle has to mark the instant of the sample";
        return key_error("sync", reason.into());
    }
    if spec.cycles_by == CyclesBy::Frames {
        let reason = "\"frames\" does not trust the stamps, and signals that are valid at the \
                      \"arrival\" of their frames need them";
        return key_error("cycles_by", reason.into());
    }
    Ok(())
}

/// Checks that the specification has no key that only a layout from device files can have.
fn check_no_objects(spec: &LayoutSpec) -> Result<(), LayoutError> {
    let (position, torque, reference) = (&spec.position, &spec.torque, spec.reference.as_ref());
    let keys = [
        ("position.object", position.object.is_some()),
        ("position.unit", position.unit.is_some()),
        ("torque.object", torque.object.is_some()),
        ("torque.unit", torque.unit.is_some()),
        ("reference.object", reference.is_some_and(|r| r.object.is_some())),
        ("reference.unit", reference.is_some_and(|r| r.unit.is_some())),
    ];
    let of_readings = reading_specs(spec).flat_map(|(_, [_, object, unit], of)| {
        [(object, of.object.is_some()), (unit, of.unit.is_some())]
    });
    match keys.into_iter().chain(of_readings).find(|(_, is_present)| *is_present) {
        Some((key, _)) => key_error(
            key,
            "is for `nodes` and `slaves` only; a DBC file has `signal` and units".into(),
        ),
        None => Ok(()),
    }
}

type Patterns = Vec<(&'static str, Quantity, SignalNames)>;

fn name_patterns(spec: &LayoutSpec) -> Result<Patterns, LayoutError> {
    let mut patterns = Vec::new();
    let signals = [
        Some(("position.signal", Quantity::Position, &spec.position.signal)),
        Some(("torque.signal", Quantity::Torque, &spec.torque.signal)),
        spec.reference.as_ref().map(|r| ("reference.signal", Quantity::Reference, &r.signal)),
    ];
    for (key, quantity, signal) in signals.into_iter().flatten() {
        let Some(signal) = signal else {
            return key_error(key, "missing: name the signal, as \"Message.Signal\"".into());
        };
        patterns.push((key, quantity, signal.clone()));
    }
    match (&spec.status_word, &spec.enabled) {
        (Some(_), Some(_)) => {
            return key_error("enabled", "says what `status_word` says; give one of them".into());
        }
        (Some(signal), None) => {
            let pattern = SignalNames::Pattern(signal.clone());
            patterns.push(("status_word", Quantity::StatusWord, pattern));
        }
        (None, Some(enabled)) => {
            patterns.push(("enabled", Quantity::Enabled, enabled.signal.clone()));
        }
        (None, None) => {}
    }
    for (reading, [key, ..], of) in reading_specs(spec) {
        let Some(signal) = &of.signal else {
            return key_error(key, "missing: name the signal, as \"Message.Signal\"".into());
        };
        patterns.push((key, Quantity::Reading(reading), signal.clone()));
    }
    if spec.law.is_some() && spec.reference.is_none() {
        let reason = "needs `reference`, the position that it holds the axis to";
        return key_error("law", reason.into());
    }
    for (reading, key, names) in law_signals(spec) {
        patterns.push((key, Quantity::Reading(reading), names.clone()));
    }
    Ok(patterns)
}

/// Returns the signal name of each axis.
fn names_of(
    key: &'static str,
    names: &SignalNames,
    axes: usize,
) -> Result<Vec<String>, LayoutError> {
    match names {
        SignalNames::Pattern(pattern) => {
            let numbered = |index: usize| pattern.replace("{axis}", &(index + 1).to_string());
            let name = |index: usize| numbered(index).replace("{index}", &index.to_string());
            Ok((0..axes).map(name).collect())
        }
        SignalNames::Listed(names) if names.len() == axes => Ok(names.clone()),
        SignalNames::Listed(names) => {
            key_error(key, format!("{} signals for {axes} axes; give one per axis", names.len()))
        }
    }
}

/// Adds to a message of the plan the rule by which its frames with other content are recognised.
fn except_in(
    database: &Database<'_>,
    messages: &mut [MessagePlan],
    name: &str,
    values: &[u16],
) -> Result<(), LayoutError> {
    let key = "except";
    let (message, signal) = split_name(key, name)?;
    if database.selector(key, message, signal)?.is_some() {
        return key_error(key, format!("`{name}` is multiplexed; name a signal of every frame"));
    }
    let signal = database.signal(key, message, signal)?;
    check_integer(Quantity::Enabled, &signal)?;
    let mut is_used = false;
    for plan in messages.iter_mut().filter(|plan| plan.format.name == message) {
        plan.excluded_values.push((signal.field, values.to_vec()));
        is_used = true;
    }
    if !is_used {
        let reason = format!("`{name}` is in no message that carries a signal of the arm");
        return key_error(key, reason);
    }
    Ok(())
}

fn split_name<'n>(key: &'static str, name: &'n str) -> Result<(&'n str, &'n str), LayoutError> {
    match name.split_once('.') {
        Some((message, signal)) if !message.is_empty() && !signal.is_empty() => {
            Ok((message, signal))
        }
        _ => Err(LayoutError::Pattern { key, pattern: name.to_owned() }),
    }
}

/// Adds one signal to the plan of its message.
fn add_message(
    database: &Database<'_>,
    messages: &mut Vec<MessagePlan>,
    key: &'static str,
    name: &str,
    quantity: Quantity,
    axis: usize,
) -> Result<(), LayoutError> {
    let (message, signal) = split_name(key, name)?;
    let format = database.message(key, message)?;
    let selector = database.selector(key, message, signal)?;
    let signal = in_own_unit(quantity, database.signal(key, message, signal)?)?;
    check_integer(quantity, &signal)?;
    let extraction = Extraction { quantity, axis, signal };
    let same_id = |plan: &&mut MessagePlan| plan.format.id == format.id;
    if messages.iter_mut().find(same_id).is_some_and(|plan| {
        // A signal of every frame would be of several axes at once.
        plan.selector.is_some() != selector.is_some()
    }) {
        let reason = format!(
            "`{name}`: other signals of the message {} are multiplexed differently; name signals \
            of the same kind",
            format.name
        );
        return key_error(key, reason);
    }
    match messages.iter_mut().filter(same_id).find(|plan| plan.selector == selector) {
        Some(plan) => {
            plan.extractions.push(extraction);
            Ok(())
        }
        None => {
            let extractions = vec![extraction];
            messages.push(MessagePlan {
                format,
                role: Role::Sample,
                extractions,
                excluded_values: Vec::new(),
                selector,
            });
            Ok(())
        }
    }
}

/// Checks that a status word, a state or a counter is an unsigned integer of an allowed width, with
/// the factor 1 and the offset 0.
pub(super) fn check_integer(quantity: Quantity, signal: &SignalFormat) -> Result<(), LayoutError> {
    let fault = match quantity {
        Quantity::Position
        | Quantity::Torque
        | Quantity::Reference
        | Quantity::NetworkState
        | Quantity::Reading(_) => None,
        Quantity::StatusWord | Quantity::Enabled | Quantity::Counter
            if signal.field.encoding() != Encoding::Unsigned
                || signal.field.scale() != (1.0, 0.0) =>
        {
            Some("has to be an unsigned integer with factor 1 and offset 0")
        }
        Quantity::StatusWord if signal.field.width() != 16 => {
            Some("a status word (6041h) has 16 bits")
        }
        Quantity::Enabled if signal.field.width() > 16 => Some("has more than 16 bits"),
        Quantity::Counter if !(4..=32).contains(&signal.field.width()) => {
            Some("a counter has 4 to 32 bits")
        }
        Quantity::StatusWord | Quantity::Enabled | Quantity::Counter => None,
    };
    match fault {
        None => Ok(()),
        Some(reason) => Err(LayoutError::Signal {
            signal: signal.name.clone(),
            line: None,
            reason: reason.to_owned(),
        }),
    }
}

fn check_overlaps(messages: &[MessagePlan]) -> Result<(), LayoutError> {
    for message in messages {
        // Several axes may share one reading.
        let is_own = |e: &&Extraction| !matches!(e.quantity, Quantity::Reading(_));
        let signals: Vec<&Extraction> = message.extractions.iter().filter(is_own).collect();
        for (k, second) in signals.iter().enumerate() {
            for first in &signals[..k] {
                if first.signal.field.overlaps(&second.signal.field) {
                    let name = |e: &Extraction| {
                        format!("{} of axis {} ({})", e.quantity, e.axis + 1, e.signal.name)
                    };
                    return Err(LayoutError::Overlap { first: name(first), second: name(second) });
                }
            }
        }
    }
    Ok(())
}

fn period_ns(spec: &LayoutSpec) -> Result<f64, LayoutError> {
    let period_us = match (spec.period_us, spec.rate_hz) {
        (Some(period), None) => period,
        (None, Some(rate)) => 1e6 / rate,
        _ => return key_error("period_us", "give either `period_us` or `rate_hz`".into()),
    };
    if !(PERIOD_US.0..=PERIOD_US.1).contains(&period_us) {
        return match spec.rate_hz {
            Some(rate) => {
                key_error("rate_hz", format!("{rate} Hz; a bus has 1 to 100000 cycles a second"))
            }
            None => {
                key_error("period_us", format!("{period_us} µs; a bus cycle takes 10 µs to 1 s"))
            }
        };
    }
    Ok(period_us * 1e3)
}

pub(super) fn key_error<T>(key: &'static str, reason: String) -> Result<T, LayoutError> {
    Err(LayoutError::Key { key, reason })
}
