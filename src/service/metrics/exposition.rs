//! Text in the exposition format of Prometheus, version 0.0.4.

use core::fmt::Write;

/// Maximum number of values of one label, such as causes or parameters.
pub const MAX_LABELS: usize = 128;

/// Type of a metric family.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FamilyKind {
    /// A value that rises and falls.
    Gauge,
    /// A value that only grows until the service restarts.
    Counter,
    /// Quantiles of the counted values.
    Summary,
}

/// The text, written family by family.
#[derive(Debug, Default)]
pub(super) struct MetricsText(String);

impl MetricsText {
    /// Begins a family. The samples of the family follow.
    pub(super) fn family<'t>(
        &'t mut self,
        name: &'static str,
        kind: FamilyKind,
        help: &str,
    ) -> Family<'t> {
        let kind = match kind {
            FamilyKind::Gauge => "gauge",
            FamilyKind::Counter => "counter",
            FamilyKind::Summary => "summary",
        };
        let help = help.replace('\\', r"\\").replace('\n', r"\n");
        self.0 += &format!("# HELP {name} {help}\n# TYPE {name} {kind}\n");
        Family { text: &mut self.0, name }
    }

    /// Returns the complete text.
    pub(super) fn finish(self) -> String {
        self.0
    }
}

/// A family being written.
#[derive(Debug)]
pub(super) struct Family<'t> {
    text: &'t mut String,
    name: &'static str,
}

impl Family<'_> {
    /// Writes the only sample of a family without labels.
    pub(super) fn value(&mut self, value: f64) {
        self.add_sample("", &[], value);
    }

    /// Writes a sample with its labels.
    pub(super) fn add_labelled(&mut self, labels: &[(&str, &str)], value: f64) {
        self.add_sample("", labels, value);
    }

    /// Writes a sample whose name is the family name with a suffix.
    pub(super) fn add_sample(&mut self, suffix: &str, labels: &[(&str, &str)], value: f64) {
        *self.text += self.name;
        *self.text += suffix;
        for (k, (label, value)) in labels.iter().enumerate() {
            *self.text += if k == 0 { "{" } else { "," };
            let value = value.replace('\\', r"\\").replace('"', "\\\"").replace('\n', r"\n");
            *self.text += &format!("{label}=\"{value}\"");
        }
        if !labels.is_empty() {
            *self.text += "}";
        }
        // Writing to a string does not fail.
        let _ = match value {
            value if value.is_nan() => writeln!(self.text, " NaN"),
            f64::INFINITY => writeln!(self.text, " +Inf"),
            f64::NEG_INFINITY => writeln!(self.text, " -Inf"),
            value => writeln!(self.text, " {value}"),
        };
    }
}

pub(super) fn write(
    text: &mut MetricsText,
    kind: FamilyKind,
    values: &[(&'static str, &str, f64)],
) {
    for (name, help, value) in values {
        text.family(name, kind, help).value(*value);
    }
}

pub(super) fn flag_value(is: bool) -> f64 {
    f64::from(u8::from(is))
}

#[expect(clippy::cast_precision_loss, reason = "Prometheus counts in f64")]
pub(super) fn count_value(value: u64) -> f64 {
    value as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_written_as_the_format_says() {
        let mut text = MetricsText::default();
        let mut family = text.family("didim_x", FamilyKind::Gauge, "One\nline, and a \\.");
        family.add_labelled(&[("a", "q\"u\\o\nte"), ("b", "µ")], 1.5);
        family.value(f64::NAN);
        family.value(f64::NEG_INFINITY);
        family.value(1e21);
        let expected = "# HELP didim_x One\\nline, and a \\\\.\n# TYPE didim_x gauge\n\
                        didim_x{a=\"q\\\"u\\\\o\\nte\",b=\"µ\"} 1.5\ndidim_x NaN\ndidim_x -Inf\n\
                        didim_x 1000000000000000000000\n";
        assert_eq!(text.finish(), expected);
    }
}
