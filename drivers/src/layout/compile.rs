//! A specification and a DBC file to a plan.

use didim_core::MAX_JOINTS;

use super::dbc::{Database, SignalFormat};
use super::error::LayoutError;
use super::field::Encoding;
use super::plan::{CompiledLayout, Extraction, MessagePlan, Quantity, Role, SampledBy};
use super::spec::{LayoutSpec, ReferenceValidity};

/// The shortest and the longest nominal period that are taken \[µs\].
const PERIOD_US: (f64, f64) = (10.0, 1e6);

impl CompiledLayout {
    /// Compiles the text of a DBC file and a specification to a plan.
    ///
    /// # Errors
    /// [`LayoutError`] says what does not fit, and where.
    pub fn compile(dbc: &str, spec: &LayoutSpec) -> Result<Self, LayoutError> {
        if !spec.nodes.is_empty() {
            return refuse("nodes", "names device files; give them or `dbc`, not both".into());
        }
        if !spec.slaves.is_empty() {
            return refuse("slaves", "are of an ENI file or a start-up, not of `dbc`".into());
        }
        check_no_objects(spec)?;
        let patterns = patterns(spec)?;
        // A pattern per axis: their number has to be one of an arm's before anything is made of it.
        check_axes(spec)?;
        let database = Database::parse(dbc)?;
        let mut messages = Vec::new();
        if let Some(name) = &spec.sync {
            let format = database.message("sync", name)?;
            messages.push(MessagePlan { format, role: Role::Sync, extractions: Vec::new() });
        }
        for (key, quantity, pattern) in patterns {
            for axis in 0..spec.axes {
                let name = pattern.replace("{axis}", &(axis + 1).to_string());
                add(&database, &mut messages, key, &name, quantity, axis)?;
            }
        }
        if let Some(pattern) = &spec.counter {
            if spec.sync.is_some() {
                return refuse(
                    "counter",
                    "is for packed frames; with `sync` there are none".into(),
                );
            }
            add(&database, &mut messages, "counter", pattern, Quantity::Counter, 0)?;
        }
        finish(messages, spec)
    }
}

fn check_axes(spec: &LayoutSpec) -> Result<(), LayoutError> {
    if (1..=MAX_JOINTS).contains(&spec.axes) {
        return Ok(());
    }
    refuse("axes", format!("{}; an arm has 1 to {MAX_JOINTS}", spec.axes))
}

/// The plan of messages, wherever they were described.
pub(super) fn finish(
    mut messages: Vec<MessagePlan>,
    spec: &LayoutSpec,
) -> Result<CompiledLayout, LayoutError> {
    check_axes(spec)?;
    let period_ns = period_ns(spec)?;
    check_overlaps(&messages)?;
    let next_sync = spec.reference.as_ref().is_some_and(|r| r.valid == ReferenceValidity::NextSync);
    for message in &mut messages {
        let target_only = message.extractions.iter().all(|e| e.quantity == Quantity::Reference);
        if message.role == Role::Sample && target_only {
            message.role = Role::Target;
        }
    }
    let sampled_by = if messages.iter().any(|message| message.role == Role::Sync) {
        SampledBy::Sync
    } else if messages.len() == 1 {
        SampledBy::Packed
    } else {
        let names: Vec<_> = messages.iter().map(|m| m.format.name.as_str()).collect();
        let reason = format!(
            "missing: the signals are in several messages ({}), so that a message of the bus has \
             to mark the instant of the sample",
            names.join(", ")
        );
        return refuse("sync", reason);
    };
    let timing = spec.torque.valid.timing(1e9 / period_ns);
    let timing = timing.or_else(|problem| refuse("torque.valid", problem))?;
    let by = spec.cycles_by;
    Ok(CompiledLayout::new(messages, sampled_by, spec.axes, period_ns, timing, next_sync, by))
}

/// Keys that only a layout from device files has.
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
    match keys.into_iter().find(|(_, given)| *given) {
        Some((key, _)) => refuse(
            key,
            "is for `nodes` and `slaves` only; a DBC file has `signal` and units".into(),
        ),
        None => Ok(()),
    }
}

type Patterns<'a> = Vec<(&'static str, Quantity, &'a str)>;

fn patterns(spec: &LayoutSpec) -> Result<Patterns<'_>, LayoutError> {
    let mut patterns = Vec::new();
    let signals = [
        Some(("position.signal", Quantity::Position, &spec.position.signal)),
        Some(("torque.signal", Quantity::Torque, &spec.torque.signal)),
        spec.reference.as_ref().map(|r| ("reference.signal", Quantity::Reference, &r.signal)),
    ];
    for (key, quantity, signal) in signals.into_iter().flatten() {
        let Some(signal) = signal else {
            return refuse(key, "missing: name the signal, as \"Message.Signal\"".into());
        };
        patterns.push((key, quantity, signal.as_str()));
    }
    if let Some(signal) = &spec.status_word {
        patterns.push(("status_word", Quantity::StatusWord, signal.as_str()));
    }
    Ok(patterns)
}

/// Adds one signal to the plan of its message.
fn add(
    database: &Database<'_>,
    messages: &mut Vec<MessagePlan>,
    key: &'static str,
    name: &str,
    quantity: Quantity,
    axis: usize,
) -> Result<(), LayoutError> {
    let (message, signal) = match name.split_once('.') {
        Some((message, signal)) if !message.is_empty() && !signal.is_empty() => (message, signal),
        _ => return Err(LayoutError::Pattern { key, pattern: name.to_owned() }),
    };
    let format = database.message(key, message)?;
    let signal = database.signal(key, message, signal)?;
    check_integer(quantity, &signal)?;
    let extraction = Extraction { quantity, axis, signal };
    match messages.iter_mut().find(|plan| plan.format.id == format.id) {
        Some(plan) if plan.role == Role::Sync => {
            refuse(key, format!("`{name}` lies in the SYNC, which carries no signals"))
        }
        Some(plan) => {
            plan.extractions.push(extraction);
            Ok(())
        }
        None => {
            let extractions = vec![extraction];
            messages.push(MessagePlan { format, role: Role::Sample, extractions });
            Ok(())
        }
    }
}

/// A status word is a word and a counter counts: neither has a scale.
pub(super) fn check_integer(quantity: Quantity, signal: &SignalFormat) -> Result<(), LayoutError> {
    let fault = match quantity {
        Quantity::Position | Quantity::Torque | Quantity::Reference | Quantity::NetworkState => {
            None
        }
        Quantity::StatusWord | Quantity::Counter
            if signal.field.encoding() != Encoding::Unsigned
                || signal.field.scale() != (1.0, 0.0) =>
        {
            Some("has to be an unsigned integer with factor 1 and offset 0")
        }
        Quantity::StatusWord if signal.field.width() != 16 => {
            Some("a status word (6041h) has 16 bits")
        }
        Quantity::Counter if !(4..=32).contains(&signal.field.width()) => {
            Some("a counter has 4 to 32 bits")
        }
        Quantity::StatusWord | Quantity::Counter => None,
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
        for (k, second) in message.extractions.iter().enumerate() {
            for first in &message.extractions[..k] {
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
        _ => return refuse("period_us", "give either `period_us` or `rate_hz`".into()),
    };
    if !(PERIOD_US.0..=PERIOD_US.1).contains(&period_us) {
        let reason = format!("{period_us} µs; a bus cycle takes 10 µs to 1 s");
        return refuse(if spec.rate_hz.is_some() { "rate_hz" } else { "period_us" }, reason);
    }
    Ok(period_us * 1e3)
}

pub(super) fn refuse<T>(key: &'static str, reason: String) -> Result<T, LayoutError> {
    Err(LayoutError::Key { key, reason })
}
