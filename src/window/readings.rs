//! What the drives told besides along the samples of a result.

use core::ops::RangeInclusive;

use didim_core::{MAX_JOINTS, Reading, Readings};
use serde::{Deserialize, Serialize};

use crate::text::significant;

/// A function of the samples alone, and of nothing that was told before them: a replay of the same samples gives the same.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DriveReadings {
    /// Temperature of the motor of each joint whose drive told one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub temperature: Vec<JointReading>,
    /// Supply or DC link voltage of each drive that told one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub supply_voltage: Vec<JointReading>,
    /// Mode of each drive that told one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub drive_mode: Vec<JointMode>,
    /// Stiffness of each joint's commands that told one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stiffness: Vec<JointReading>,
    /// Damping, likewise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub damping: Vec<JointReading>,
    /// Speed target, likewise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub speed_target: Vec<JointReading>,
    /// Torque that commands add, likewise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub torque_target: Vec<JointReading>,
}

/// A quantity that a drive told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointReading {
    /// The joint, from 1.
    pub joint: usize,
    /// The unit of the values, as `degC`.
    pub unit: String,
    /// Mean of what was told.
    pub mean: f64,
    /// The least of it.
    pub minimum: f64,
    /// The most.
    pub maximum: f64,
    /// What was told first.
    pub first: f64,
    /// What was told last.
    pub last: f64,
    /// How often it was told.
    pub readings: u64,
}

/// The mode of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct JointMode {
    /// The joint, from 1.
    pub joint: usize,
    /// The number that the drive told last.
    pub mode: i16,
}

/// Of one reading of one joint, in steps.
#[derive(Clone, Copy)]
struct Sum {
    sum: i64,
    count: u32,
    range: [i16; 2],
    ends: [i16; 2],
}

impl Sum {
    fn with(before: Option<Self>, value: i16) -> Self {
        let Some(Self { sum, count, range: [least, most], ends: [first, _] }) = before else {
            let both = [value; 2];
            return Self { sum: value.into(), count: 1, range: both, ends: both };
        };
        Self {
            sum: sum + i64::from(value),
            count: count + 1,
            range: [least.min(value), most.max(value)],
            ends: [first, value],
        }
    }
}

impl DriveReadings {
    /// What was told in these cycles, in their order.
    pub fn of<'a>(cycles: impl IntoIterator<Item = &'a Readings>) -> Self {
        let mut sums = [[None; MAX_JOINTS]; Reading::ALL.len()];
        for readings in cycles.into_iter().filter(|readings| !readings.is_empty()) {
            for reading in Reading::ALL {
                for (joint, sum) in sums[reading as usize].iter_mut().enumerate() {
                    if let Some(value) = readings.get(reading, joint) {
                        *sum = Some(Sum::with(*sum, value));
                    }
                }
            }
        }
        let of = |reading: Reading| {
            let joints = sums[reading as usize].iter().enumerate();
            joints.filter_map(|(joint, sum)| sum.map(|sum| (joint + 1, sum)))
        };
        let values = |reading: Reading| {
            let steps = reading.steps_per_unit();
            let one = |(joint, Sum { sum, count, range, ends }): (usize, Sum)| {
                let [minimum, maximum] = range.map(|value| f64::from(value) / steps);
                let [first, last] = ends.map(|value| f64::from(value) / steps);
                #[expect(clippy::cast_precision_loss, reason = "16 bits times a window's samples")]
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
            };
            of(reading).map(one).collect()
        };
        Self {
            temperature: values(Reading::Temperature),
            supply_voltage: values(Reading::SupplyVoltage),
            drive_mode: of(Reading::Mode)
                .map(|(joint, sum)| JointMode { joint, mode: sum.ends[1] })
                .collect(),
            stiffness: values(Reading::Stiffness),
            damping: values(Reading::Damping),
            speed_target: values(Reading::SpeedTarget),
            torque_target: values(Reading::TorqueTarget),
        }
    }

    /// For people: a name, and the values joint by joint.
    pub fn lines(&self) -> Vec<(&'static str, String)> {
        let values = |of: &[JointReading], unit: &str| {
            let all = of.iter().map(JointReading::text).collect::<Vec<_>>().join(", ");
            (!of.is_empty()).then(|| format!("{all} {unit}"))
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

    /// The mean temperatures of the coolest and of the hottest motor \[°C\].
    pub fn temperatures_c(&self) -> Option<RangeInclusive<f64>> {
        let means = || self.temperature.iter().map(|of| of.mean);
        Some(means().reduce(f64::min)?..=means().reduce(f64::max)?)
    }

    /// The mean of all motors' mean temperatures \[°C\].
    pub fn mean_temperature_c(&self) -> Option<f64> {
        let (sum, count) =
            self.temperature.iter().fold((0.0, 0.0), |(sum, n), of| (sum + of.mean, n + 1.0));
        (count > 0.0).then(|| sum / count)
    }
}

impl JointReading {
    /// `joint 2 36.4 (35 to 38)`
    fn text(&self) -> String {
        let Self { joint, mean, minimum, maximum, .. } = self;
        let range =
            if minimum < maximum { format!(" ({minimum} to {maximum})") } else { String::new() };
        format!("joint {joint} {}{range}", significant(*mean, 3))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp, reason = "tenths of what was told")]

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
    fn means_ranges_and_ends_are_of_what_was_told() {
        let none = Readings::default();
        let cycles = [
            cycle(1, 35.0, None),
            none,
            cycle(1, 37.5, Some(8.0)),
            cycle(3, 50.0, None),
            cycle(1, 36.0, None),
        ];
        let found = DriveReadings::of(&cycles);
        let [second, fourth] = found.temperature.as_slice() else { panic!("{found:?}") };
        assert_eq!((second.joint, second.readings, second.unit.as_str()), (2, 3, "degC"));
        assert!((second.mean - 108.5 / 3.0).abs() < 1e-12);
        assert_eq!([second.minimum, second.maximum], [35.0, 37.5]);
        assert_eq!([second.first, second.last], [35.0, 36.0]);
        assert_eq!((fourth.joint, fourth.mean, fourth.readings), (4, 50.0, 1));
        assert_eq!(found.drive_mode, [JointMode { joint: 2, mode: 8 }]);
        assert!(found.supply_voltage.is_empty());
        let lines = found.lines();
        assert_eq!(
            lines,
            [
                ("motor temperature", "joint 2 36.2 (35 to 37.5), joint 4 50.0 °C".to_owned()),
                ("drive mode", "joint 2 in 8".to_owned()),
            ]
        );
        let range = found.temperatures_c().unwrap();
        assert!((*range.start() - 36.1667).abs() < 1e-3 && *range.end() == 50.0);
        assert!((found.mean_temperature_c().unwrap() - 43.083).abs() < 1e-3);
    }

    #[test]
    fn what_nobody_told_is_not_there() {
        let found = DriveReadings::of(&[Readings::default(); 3]);
        assert_eq!(found, DriveReadings::default());
        assert_eq!(serde_json::to_string(&found).unwrap(), "{}");
        assert!(found.lines().is_empty() && found.temperatures_c().is_none());
        assert_eq!(found.mean_temperature_c(), None);
    }

    #[test]
    fn json_is_read_back() {
        let found = DriveReadings::of(&[cycle(0, -12.3, Some(-1.0))]);
        let json = serde_json::to_string(&found).unwrap();
        assert_eq!(
            json,
            "{\"temperature\":[{\"joint\":1,\"unit\":\"degC\",\"mean\":-12.3,\"minimum\":-12.3,\
             \"maximum\":-12.3,\"first\":-12.3,\"last\":-12.3,\"readings\":1}],\
             \"drive_mode\":[{\"joint\":1,\"mode\":-1}]}"
        );
        assert_eq!(serde_json::from_str::<DriveReadings>(&json).unwrap(), found);
    }
}
