//! Additional drive readings along the samples of a result.

use core::ops::RangeInclusive;
use didim_dynamics::robot::JointIndex;

use didim_dynamics::{MAX_JOINTS, Reading, Readings};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::text::significant_digits;

/// Drive readings during the samples of a result. They depend only on these samples and not on
/// earlier readings, so that a replay of the samples gives the same values.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DriveReadings {
    /// Motor temperature of each joint whose drive reports one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub temperature: Vec<JointReading>,
    /// Supply or DC link voltage of each drive that reports one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub supply_voltage: Vec<JointReading>,
    /// Mode of each drive that reports one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub drive_mode: Vec<JointMode>,
    /// Stiffness of each joint whose commands state one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stiffness: Vec<JointReading>,
    /// Damping of each joint whose commands state one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub damping: Vec<JointReading>,
    /// Speed target of each joint whose commands state one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub speed_target: Vec<JointReading>,
    /// Added torque of each joint whose commands state one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub torque_target: Vec<JointReading>,
}

/// A quantity reported by a drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JointReading {
    /// The joint.
    pub joint: JointIndex,
    /// Unit of the values, such as `degC`.
    pub unit: String,
    /// Mean of the readings.
    pub mean: f64,
    /// Smallest reading.
    pub minimum: f64,
    /// Largest reading.
    pub maximum: f64,
    /// First reading.
    pub first: f64,
    /// Last reading.
    pub last: f64,
    /// Number of readings.
    pub readings: u64,
}

/// The mode of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct JointMode {
    /// The joint.
    pub joint: JointIndex,
    /// Number that the drive reported last.
    pub mode: i16,
}

/// Sums over one reading of one joint, in steps of the reading.
#[derive(Clone, Copy)]
struct ReadingSum {
    sum: i64,
    count: u32,
    range: [i16; 2],
    first_and_last: [i16; 2],
}

impl ReadingSum {
    fn extend(before: Option<Self>, value: i16) -> Self {
        let Some(Self { sum, count, range: [least, most], first_and_last: [first, _] }) = before
        else {
            let both = [value; 2];
            return Self { sum: value.into(), count: 1, range: both, first_and_last: both };
        };
        Self {
            sum: sum + i64::from(value),
            count: count + 1,
            range: [least.min(value), most.max(value)],
            first_and_last: [first, value],
        }
    }
}

impl DriveReadings {
    /// Collects the readings of these cycles. The cycles must be in their order in time.
    pub fn from_cycles<'a>(cycles: impl IntoIterator<Item = &'a Readings>) -> Self {
        let mut sums = [[None; MAX_JOINTS]; Reading::ALL.len()];
        for readings in cycles.into_iter().filter(|readings| !readings.is_empty()) {
            for reading in Reading::ALL {
                for (joint, sum) in sums[reading as usize].iter_mut().enumerate() {
                    if let Some(value) = readings.get(reading, joint) {
                        *sum = Some(ReadingSum::extend(*sum, value));
                    }
                }
            }
        }
        let joints_of = |reading: Reading| {
            let joints = sums[reading as usize].iter().enumerate();
            joints.filter_map(|(joint, sum)| sum.map(|sum| (JointIndex::new(joint), sum)))
        };
        let values = |reading: Reading| {
            let steps = reading.steps_per_unit();
            joints_of(reading)
                .map(
                    |(joint, ReadingSum { sum, count, range, first_and_last: ends }): (
                        JointIndex,
                        ReadingSum,
                    )| {
                        let [minimum, maximum] = range.map(|value| f64::from(value) / steps);
                        let [first, last] = ends.map(|value| f64::from(value) / steps);
                        #[expect(
                            clippy::cast_precision_loss,
                            reason = "16 bits times a window's samples"
                        )]
                        let mean = sum as f64 / (steps * f64::from(count));
                        let unit = reading.unit().to_owned();
                        JointReading {
                            joint,
                            unit,
                            mean,
                            minimum,
                            maximum,
                            first,
                            last,
                            readings: count.into(),
                        }
                    },
                )
                .collect()
        };
        Self {
            temperature: values(Reading::Temperature),
            supply_voltage: values(Reading::SupplyVoltage),
            drive_mode: joints_of(Reading::Mode)
                .map(|(joint, sum)| JointMode { joint, mode: sum.first_and_last[1] })
                .collect(),
            stiffness: values(Reading::Stiffness),
            damping: values(Reading::Damping),
            speed_target: values(Reading::SpeedTarget),
            torque_target: values(Reading::TorqueTarget),
        }
    }

    /// Formats the readings as text for people: the name of each reading, and its values by joint.
    pub fn lines(&self) -> Vec<(&'static str, String)> {
        let values = |of: &[JointReading], unit: &str| {
            let all_values = of.iter().map(JointReading::text).collect::<Vec<_>>().join(", ");
            (!of.is_empty()).then(|| format!("{all_values} {unit}"))
        };
        let modes: Vec<String> =
            self.drive_mode.iter().map(|of| format!("joint {} in {}", of.joint, of.mode)).collect();
        let lines = [
            ("motor temperature", values(&self.temperature, "°C")),
            ("supply voltage", values(&self.supply_voltage, "V")),
            ("drive mode", (!modes.is_empty()).then(|| modes.join(", "))),
        ];
        lines.into_iter().filter_map(|(name, text)| Some((name, text?))).collect()
    }

    /// Returns the mean temperatures of the coolest and of the hottest motor \[°C\].
    pub fn temperatures_c(&self) -> Option<RangeInclusive<f64>> {
        let means = || self.temperature.iter().map(|of| of.mean);
        Some(means().reduce(f64::min)?..=means().reduce(f64::max)?)
    }

    /// Returns the mean of all motors' mean temperatures \[°C\].
    pub fn mean_temperature_c(&self) -> Option<f64> {
        let (sum, count) =
            self.temperature.iter().fold((0.0, 0.0), |(sum, n), of| (sum + of.mean, n + 1.0));
        (count > 0.0).then(|| sum / count)
    }
}

impl JointReading {
    /// Formats the reading as text, such as `joint 2 36.4 (35 to 38)`.
    fn text(&self) -> String {
        let Self { joint, mean, minimum, maximum, .. } = self;
        let range =
            if minimum < maximum { format!(" ({minimum} to {maximum})") } else { String::new() };
        format!("joint {joint} {}{range}", significant_digits(*mean, 3))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp, reason = "tenths of the reported values")]

    use super::*;

    fn cycle(joint: usize, temperature: f64, mode: Option<f64>) -> Readings {
        let mut readings = Readings::default();
        readings.set(Reading::Temperature, joint, temperature);
        if let Some(mode) = mode {
            readings.set(Reading::Mode, joint, mode);
        }
        readings
    }

    #[test]
    fn means_ranges_and_ends_are_of_what_was_reported() {
        let none = Readings::default();
        let cycles = [
            cycle(1, 35.0, None),
            none,
            cycle(1, 37.5, Some(8.0)),
            cycle(3, 50.0, None),
            cycle(1, 36.0, None),
        ];
        let readings = DriveReadings::from_cycles(&cycles);
        let [second, fourth] = readings.temperature.as_slice() else { panic!("{readings:?}") };
        assert_eq!((second.joint.number(), second.readings, second.unit.as_str()), (2, 3, "degC"));
        assert!((second.mean - 108.5 / 3.0).abs() < 1e-12);
        assert_eq!([second.minimum, second.maximum], [35.0, 37.5]);
        assert_eq!([second.first, second.last], [35.0, 36.0]);
        assert_eq!((fourth.joint.number(), fourth.mean, fourth.readings), (4, 50.0, 1));
        assert_eq!(readings.drive_mode, [JointMode { joint: JointIndex::new(1), mode: 8 }]);
        assert!(readings.supply_voltage.is_empty());
        let lines = readings.lines();
        assert_eq!(
            lines,
            [
                ("motor temperature", "joint 2 36.2 (35 to 37.5), joint 4 50.0 °C".to_owned()),
                ("drive mode", "joint 2 in 8".to_owned()),
            ]
        );
        let range = readings.temperatures_c().unwrap();
        assert!((*range.start() - 36.1667).abs() < 1e-3 && *range.end() == 50.0);
        assert!((readings.mean_temperature_c().unwrap() - 43.083).abs() < 1e-3);
    }

    #[test]
    fn what_nobody_reported_is_not_there() {
        let readings = DriveReadings::from_cycles(&[Readings::default(); 3]);
        assert_eq!(readings, DriveReadings::default());
        assert_eq!(serde_json::to_string(&readings).unwrap(), "{}");
        assert!(readings.lines().is_empty() && readings.temperatures_c().is_none());
        assert_eq!(readings.mean_temperature_c(), None);
    }

    #[test]
    fn json_is_read_back() {
        let readings = DriveReadings::from_cycles(&[cycle(0, -12.3, Some(-1.0))]);
        let json = serde_json::to_string(&readings).unwrap();
        assert_eq!(
            json,
            "{\"temperature\":[{\"joint\":1,\"unit\":\"degC\",\"mean\":-12.3,\"minimum\":-12.3,\
             \"maximum\":-12.3,\"first\":-12.3,\"last\":-12.3,\"readings\":1}],\
             \"drive_mode\":[{\"joint\":1,\"mode\":-1}]}"
        );
        assert_eq!(serde_json::from_str::<DriveReadings>(&json).unwrap(), readings);
    }
}
