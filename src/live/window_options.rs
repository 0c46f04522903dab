//! Window options of the cell file. They set the times of identification.

use schemars::JsonSchema;
use serde::Deserialize;

/// Definition of a window, in seconds. [`WindowOptions::plan`] checks the ranges.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WindowOptions {
    /// The trigger that opens and closes a window: one of the forms below.
    pub trigger: Trigger,
    /// Samples kept before those that count, for the edges of the filters \[s\]; 0 to 10.
    #[serde(default = "default_margin_s")]
    pub margin_before_s: f64,
    /// Samples kept after those that count \[s\]; 0 to 10.
    #[serde(default = "default_margin_s")]
    pub margin_after_s: f64,
    /// A window with fewer counted samples than this is rejected as too short \[s\]; 0 to 600.
    #[serde(default = "default_min_s")]
    pub min_s: f64,
    /// A window is closed at this length, its margins included \[s\]: the bound of its memory; 0.1
    /// to 600.
    #[serde(default = "default_max_s")]
    pub max_s: f64,
}

impl WindowOptions {
    /// Returns options for windows that are opened by command only, with the default margins.
    pub fn by_command() -> Self {
        Self {
            trigger: Trigger::Command {},
            margin_before_s: default_margin_s(),
            margin_after_s: default_margin_s(),
            min_s: default_min_s(),
            max_s: default_max_s(),
        }
    }
}

/// Event that opens and closes a window.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(tag = "by", deny_unknown_fields, rename_all = "kebab-case")]
pub enum Trigger {
    /// Motion opens it, rest closes it.
    Motion {
        /// A motor that turns faster than this is in motion \[rad/s\]. The speed is that of the
        /// motor, before the gear.
        velocity_threshold_rad_s: f64,
        /// Rest closes the window after this time, or after `margin_after_s` where that is longer
        /// \[s\]; 0 to 60.
        #[serde(default = "default_idle_s")]
        idle_s: f64,
        /// The speed is the difference of two positions this far apart \[s\]: long enough that one
        /// count of the encoder is no motion; 0 to 1.
        #[serde(default = "default_difference_s")]
        difference_s: f64,
    },
    /// Consecutive windows, each with the same number of counted samples.
    Interval {
        /// Length of the counted samples of each window \[s\]: `min_s` at least, and with its
        /// margins `max_s` at most.
        length_s: f64,
    },
    /// `window begin` opens it, `window end` closes it. It has braces because a unit variant would
    /// accept unknown keys.
    Command {},
}

fn default_margin_s() -> f64 {
    0.25
}

fn default_min_s() -> f64 {
    2.0
}

fn default_max_s() -> f64 {
    60.0
}

fn default_idle_s() -> f64 {
    0.5
}

fn default_difference_s() -> f64 {
    0.01
}

/// The options, converted to samples of the uniform grid.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowPlan {
    /// The trigger.
    pub trigger: PlannedTrigger,
    /// Number of samples in the margin before the counted samples.
    pub margin_before: usize,
    /// Number of samples in the margin after the counted samples.
    pub margin_after: usize,
    /// Minimum number of counted samples.
    pub min: usize,
    /// Maximum number of samples of a window, including margins.
    pub max: usize,
    /// Sample rate \[Hz\].
    pub sample_rate_hz: f64,
}

/// A trigger in samples.
#[derive(Clone, Debug, PartialEq)]
pub enum PlannedTrigger {
    /// See [`Trigger::Motion`].
    Motion {
        /// Distance over `lag` samples above which a motor is in motion \[rad\].
        travel_rad: f64,
        /// Number of samples between the compared positions.
        lag: usize,
        /// Number of samples at rest that close the window. It is at least the margin after the
        /// counted samples.
        idle: usize,
    },
    /// See [`Trigger::Interval`].
    Interval {
        /// Number of counted samples.
        length: usize,
    },
    /// See [`Trigger::Command`].
    Command,
}

/// A window option is outside its range. Change it in the cell file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("window option {key}: {problem}")]
pub struct WindowOptionError {
    /// Key of the option.
    pub key: &'static str,
    /// The problem, and the allowed values.
    pub problem: String,
}

impl WindowOptions {
    /// Checks every option and converts it to samples.
    ///
    /// # Errors
    /// [`WindowOptionError`] names the first invalid option.
    pub fn plan(&self, sample_rate_hz: f64) -> Result<WindowPlan, WindowOptionError> {
        if !(1.0..=20_000.0).contains(&sample_rate_hz) {
            return key_error("sample_rate_hz", format!("{sample_rate_hz} is not in 1..=20000"));
        }
        let count = |key, seconds: f64, low: f64, high: f64| {
            if !(low..=high).contains(&seconds) {
                return key_error(key, format!("{seconds} s is not in {low}..={high} s"));
            }
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "at most 3,600 s at 20 kHz"
            )]
            Ok((seconds * sample_rate_hz).round() as usize)
        };
        let margin_before = count("margin_before_s", self.margin_before_s, 0.0, 10.0)?;
        let margin_after = count("margin_after_s", self.margin_after_s, 0.0, 10.0)?;
        let margins = margin_before + margin_after;
        // At least two, so that no window is opened and closed by the same sample.
        let min = count("min_s", self.min_s, 0.0, 600.0)?.max(2);
        let max = count("max_s", self.max_s, 0.1, 600.0)?;
        if max < margins + min {
            return key_error(
                "max_s",
                format!(
                    "{} s is too short for min_s and two margins, {} s",
                    self.max_s,
                    self.min_s + self.margin_before_s + self.margin_after_s
                ),
            );
        }
        let trigger = match self.trigger {
            Trigger::Motion { velocity_threshold_rad_s: threshold, idle_s, difference_s } => {
                if !(threshold > 0.0 && threshold <= 1e4) {
                    return key_error(
                        "velocity_threshold_rad_s",
                        format!("{threshold} is not in 0 (excluded)..=10000"),
                    );
                }
                let lag = count("difference_s", difference_s, 0.0, 1.0)?.max(1);
                let idle = count("idle_s", idle_s, 0.0, 60.0)?.max(margin_after).max(1);
                #[expect(clippy::cast_precision_loss, reason = "at most 20,000")]
                let travel_rad = threshold * lag as f64 / sample_rate_hz;
                PlannedTrigger::Motion { travel_rad, lag, idle }
            }
            Trigger::Interval { length_s } => {
                let length = count("length_s", length_s, 0.0, 600.0)?;
                if length < min || length + margins > max {
                    return key_error(
                        "length_s",
                        format!(
                            "{length_s} s is less than min_s or does not fit into max_s with its \
                             margins"
                        ),
                    );
                }
                PlannedTrigger::Interval { length }
            }
            Trigger::Command {} => PlannedTrigger::Command,
        };
        Ok(WindowPlan { trigger, margin_before, margin_after, min, max, sample_rate_hz })
    }
}

fn key_error<T>(key: &'static str, problem: String) -> Result<T, WindowOptionError> {
    Err(WindowOptionError { key, problem })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_trigger_refuses_keys_that_it_does_not_know() {
        for (trigger, key) in [
            ("by = \"motion\"\nvelocity_threshold_rad_s = 0.1", "length_s = 1.0"),
            ("by = \"interval\"\nlength_s = 1.0", "idle_s = 1.0"),
            ("by = \"command\"", "idle_s = 1.0"),
        ] {
            toml::from_str::<Trigger>(trigger).unwrap();
            let error = toml::from_str::<Trigger>(&format!("{trigger}\n{key}")).unwrap_err();
            assert!(error.message().contains("unknown field"), "{error}");
        }
    }
}
