//! Medians over arms, and the distance of each arm from them.

use didim_dynamics::numeric::median;
use serde::Serialize;

use super::limits::FleetLimits;
use super::member::{FleetError, Member, MemberParameter};

/// Ratio of the standard deviation to the median absolute deviation of a normal distribution.
const NORMAL_MAD_RATIO: f64 = 1.4826;

/// Arms of one type.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fleet {
    /// Version of the layout. It changes when a key changes its meaning or is removed.
    pub schema: u32,
    /// Robot of all arms.
    pub robot: String,
    /// Method of all results.
    pub method: String,
    /// Arms, each with its name and its result.
    pub arms: Vec<Member>,
    /// Parameters, in the order of the first arm's parameters.
    pub parameters: Vec<FleetParameter>,
}

/// A parameter of all arms. All values are in its unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FleetParameter {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Median of the arms.
    pub median: f64,
    /// Scatter of the arms as a standard deviation: 1.4826 times the median absolute deviation.
    pub scatter: f64,
    /// Limit for the magnitude of `deviation`. If all arms are alike, one in a thousand comparisons
    /// exceeds it.
    pub limit: f64,
    /// Arms, in the order of the fleet.
    pub arms: Vec<ArmDeviation>,
}

/// Position of one arm relative to the others in one parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ArmDeviation {
    /// The arm.
    pub arm: String,
    /// Value of the arm's parameter.
    pub value: f64,
    /// Combined standard uncertainty, or the statistical one if there is no combined one.
    pub combined_standard_deviation: f64,
    /// Distance from the median, in units of the root sum square of scatter and statistical
    /// standard deviation.
    pub deviation: f64,
    /// Distance from the median as in `deviation`, but with the combined standard uncertainty in
    /// place of the statistical one.
    pub combined_deviation: f64,
}

impl FleetParameter {
    /// Returns true if the deviation of an arm exceeds the limit.
    pub fn is_outside(&self, standing: &ArmDeviation) -> bool {
        standing.deviation.abs() > self.limit
    }

    /// Returns true if the deviation exceeds the limit even under the assumption that the model
    /// errors of different arms are independent.
    pub fn is_outside_for_certain(&self, standing: &ArmDeviation) -> bool {
        standing.combined_deviation.abs() > self.limit
    }

    fn new(own: &MemberParameter, arms: &[Member]) -> Option<Self> {
        let values = arms.iter().filter_map(|arm| Some((arm, arm.parameter(&own.name)?)));
        let values: Vec<_> = values.filter(|(_, of)| of.value.is_finite()).collect();
        if values.len() < FleetLimits::DEFAULT.min_arms {
            return None;
        }
        let median_value = median(values.iter().map(|(_, of)| of.value).collect())?;
        let away = values.iter().map(|(_, of)| (of.value - median_value).abs());
        let scatter = NORMAL_MAD_RATIO * median(away.collect())?;
        Some(Self {
            name: own.name.clone(),
            unit: own.unit.clone(),
            median: median_value,
            scatter,
            limit: deviation_limit(values.len()),
            arms: values
                .iter()
                .map(|(arm, of): &(&Member, &MemberParameter)| {
                    let combined = of.combined_standard_deviation.unwrap_or(of.standard_deviation);
                    let deviation =
                        |uncertainty: f64| (of.value - median_value) / scatter.hypot(uncertainty);
                    ArmDeviation {
                        arm: arm.name.clone(),
                        value: of.value,
                        combined_standard_deviation: combined,
                        deviation: deviation(of.standard_deviation),
                        combined_deviation: deviation(combined),
                    }
                })
                .collect(),
        })
    }
}

impl Fleet {
    /// Compares arms.
    ///
    /// # Errors
    /// [`FleetError`]: too few arms, or not of one type.
    pub fn new(arms: Vec<Member>) -> Result<Self, FleetError> {
        let first = arms.first().filter(|_| arms.len() >= FleetLimits::DEFAULT.min_arms);
        let first = first.ok_or(FleetError::TooFew { arms: arms.len() })?;
        if let Some(other) = arms.iter().find(|arm| arm.kind() != first.kind()) {
            return Err(FleetError::OtherKind {
                arm: first.name.clone(),
                kind: first.kind_text(),
                other: other.name.clone(),
                other_kind: other.kind_text(),
            });
        }
        let parameters = first.parameters.iter();
        let parameters = parameters.filter_map(|own| FleetParameter::new(own, &arms)).collect();
        let (robot, method) = (first.robot.clone(), first.method.clone());
        Ok(Self { schema: 1, robot, method, arms, parameters })
    }

    /// Returns each parameter of each arm, the one with the largest share of its limit first.
    pub fn by_share_of_limit(&self) -> Vec<(&FleetParameter, &ArmDeviation)> {
        let deviations =
            self.parameters.iter().flat_map(|of| of.arms.iter().map(move |arm| (of, arm)));
        let mut deviations: Vec<_> =
            deviations.filter(|(_, arm)| arm.deviation.is_finite()).collect();
        deviations.sort_by(|(of, a), (other, b)| {
            (b.deviation.abs() / other.limit).total_cmp(&(a.deviation.abs() / of.limit))
        });
        deviations
    }

    /// Returns the number of deviations that exceed their limits.
    pub fn outside_count(&self) -> usize {
        let count_outside =
            |of: &FleetParameter| of.arms.iter().filter(|arm| of.is_outside(arm)).count();
        self.parameters.iter().map(count_outside).sum()
    }
}

/// Returns the limit that 99.9 % of the deviations of similar arms stay below, if their scatter is
/// estimated from the same arms. The formula is a fit to simulated normal populations of 6 to 100
/// arms.
#[expect(clippy::cast_precision_loss, reason = "arms")]
fn deviation_limit(arms: usize) -> f64 {
    3.3 + 40.0 / (arms as f64 - 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fixed sequence of approximately normal numbers: sums of twelve uniform numbers.
    fn normal() -> impl FnMut() -> f64 {
        let mut state = 7_u64;
        move || {
            let mut uniform = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                f64::from(u32::try_from(state >> 32).unwrap()) / f64::from(u32::MAX)
            };
            (0..12).map(|_| uniform()).sum::<f64>() - 6.0
        }
    }

    /// Arms with parameters of 100 ± 1 and an own uncertainty of ± 0.5.
    fn arms(count: usize, parameters: usize) -> Vec<Member> {
        let mut normal = normal();
        let mut parameter = |k: usize| MemberParameter {
            name: format!("p{k}"),
            unit: "N·m".into(),
            value: 100.0 + normal() + 0.5 * normal(),
            standard_deviation: 0.5,
            combined_standard_deviation: Some(3.0),
        };
        let arm = |k: usize| Member {
            name: format!("arm {k}"),
            robot: "tx40".into(),
            method: "didim".into(),
            regrouping: "r".into(),
            result: 1,
            time: String::new(),
            parameters: (0..parameters).map(&mut parameter).collect(),
        };
        (0..count).map(arm).collect()
    }

    #[test]
    fn arms_that_are_alike_stay_in_and_one_that_is_not_leaves() {
        for count in [6, 8, 12, 30] {
            let fleet = Fleet::new(arms(count, 200)).unwrap();
            let outside = fleet.outside_count();
            assert!(1000 * outside < 2 * 200 * count, "{outside} of {count} arms");
            let mut worn = arms(count, 200);
            worn[1].parameters[3].value += 60.0;
            worn[2].parameters[4].value -= 200.0;
            let fleet = Fleet::new(worn).unwrap();
            let furthest = fleet.by_share_of_limit();
            let names: Vec<_> = furthest
                .iter()
                .take(2)
                .map(|(of, arm)| (of.name.as_str(), arm.arm.as_str()))
                .collect();
            assert_eq!(names, [("p4", "arm 2"), ("p3", "arm 1")], "{count}");
            let (of, first) = furthest[0];
            assert!(of.is_outside_for_certain(first) && first.deviation < 0.0);
        }
    }

    #[test]
    fn the_median_and_the_scatter_are_not_moved_by_one_arm() {
        let mut seven = arms(7, 1);
        for (arm, value) in seven.iter_mut().zip([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 1e9]) {
            arm.parameters[0].value = value;
        }
        let fleet = Fleet::new(seven).unwrap();
        let parameter = &fleet.parameters[0];
        assert_eq!(
            (parameter.median, parameter.scatter, parameter.limit),
            (4.0, NORMAL_MAD_RATIO * 2.0, 3.3 + 8.0)
        );
        // All are equal to the last digit: the arm's own uncertainty decides.
        let mut same = arms(6, 1);
        same.iter_mut().for_each(|arm| arm.parameters[0].value = 1.0);
        same[5].parameters[0].value = 9.0;
        let fleet = Fleet::new(same).unwrap();
        let deviations: Vec<f64> =
            fleet.parameters[0].arms.iter().map(|arm| arm.deviation).collect();
        assert_eq!(deviations, [0.0, 0.0, 0.0, 0.0, 0.0, 16.0]);
    }

    #[test]
    fn few_arms_and_arms_of_other_types_are_refused() {
        let said = |arms| Fleet::new(arms).unwrap_err().to_string();
        assert!(said(arms(5, 1)).contains("5 arms") && said(Vec::new()).contains("0 arms"));
        let mut mixed = arms(7, 1);
        mixed[4].method = "idim-ls".into();
        let said = said(mixed);
        assert!(said.contains("arm 4") && said.contains("idim-ls"), "{said}");
        let mut missing = arms(6, 2);
        missing[3].parameters.remove(1);
        assert_eq!(Fleet::new(missing).unwrap().parameters.len(), 1);
    }
}
