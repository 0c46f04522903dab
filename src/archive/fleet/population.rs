//! Medians over arms, and how far each arm is from them.

use didim_core::numeric::median;
use serde::Serialize;

use super::member::{FEWEST_ARMS, FleetError, Member, MemberParameter};

/// The median absolute deviation of a normal distribution, times this, is its standard deviation.
const NORMAL: f64 = 1.4826;

/// Arms of one type.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fleet {
    /// Version of its layout: it changes when a key changes its meaning or goes away.
    pub schema: u32,
    /// Their robot.
    pub robot: String,
    /// The method of their results.
    pub method: String,
    /// Each arm: its name, and its result.
    pub arms: Vec<Member>,
    /// The parameters, in the order of the first arm's.
    pub parameters: Vec<FleetParameter>,
}

/// A parameter over all arms, in its unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FleetParameter {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Median of the arms.
    pub median: f64,
    /// Their scatter, as a standard deviation: 1.4826 times the median of what they are from the median.
    pub scatter: f64,
    /// What one in a thousand comparisons is beyond where all arms are alike.
    pub limit: f64,
    /// Each arm, in the order of the fleet.
    pub arms: Vec<Standing>,
}

/// How one arm stands to the others in one parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Standing {
    /// The arm.
    pub arm: String,
    /// Its value.
    pub value: f64,
    /// Its combined standard uncertainty, or the statistical one where it has no other.
    pub combined_standard_deviation: f64,
    /// Distance from the median, in units of scatter and statistical standard deviation together.
    pub deviation: f64,
    /// The same with the combined one.
    pub combined_deviation: f64,
}

impl FleetParameter {
    /// Whether an arm has left the population.
    pub fn is_outside(&self, standing: &Standing) -> bool {
        standing.deviation.abs() > self.limit
    }

    /// Whether it has even if all that is uncertain of its model were its own, and none common to arms of one type.
    pub fn is_outside_for_certain(&self, standing: &Standing) -> bool {
        standing.combined_deviation.abs() > self.limit
    }

    fn new(own: &MemberParameter, arms: &[Member]) -> Option<Self> {
        let found = arms.iter().filter_map(|arm| Some((arm, arm.parameter(&own.name)?)));
        let found: Vec<_> = found.filter(|(_, of)| of.value.is_finite()).collect();
        if found.len() < FEWEST_ARMS {
            return None;
        }
        let median_value = median(found.iter().map(|(_, of)| of.value).collect())?;
        let away = found.iter().map(|(_, of)| (of.value - median_value).abs());
        let scatter = NORMAL * median(away.collect())?;
        let standing = |(arm, of): &(&Member, &MemberParameter)| {
            let combined = of.combined_standard_deviation.unwrap_or(of.standard_deviation);
            let deviation =
                |uncertainty: f64| (of.value - median_value) / scatter.hypot(uncertainty);
            Standing {
                arm: arm.name.clone(),
                value: of.value,
                combined_standard_deviation: combined,
                deviation: deviation(of.standard_deviation),
                combined_deviation: deviation(combined),
            }
        };
        Some(Self {
            name: own.name.clone(),
            unit: own.unit.clone(),
            median: median_value,
            scatter,
            limit: limit(found.len()),
            arms: found.iter().map(standing).collect(),
        })
    }
}

impl Fleet {
    /// Compares arms.
    ///
    /// # Errors
    /// [`FleetError`]: too few, or not of one type.
    pub fn new(arms: Vec<Member>) -> Result<Self, FleetError> {
        let first = arms.first().filter(|_| arms.len() >= FEWEST_ARMS);
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

    /// Each parameter of each arm, the one that uses the most of its limit first.
    pub fn furthest(&self) -> Vec<(&FleetParameter, &Standing)> {
        let all = self.parameters.iter().flat_map(|of| of.arms.iter().map(move |arm| (of, arm)));
        let mut all: Vec<_> = all.filter(|(_, arm)| arm.deviation.is_finite()).collect();
        all.sort_by(|(of, a), (other, b)| {
            (b.deviation.abs() / other.limit).total_cmp(&(a.deviation.abs() / of.limit))
        });
        all
    }

    /// How many of them are outside.
    pub fn outside(&self) -> usize {
        let of = |of: &FleetParameter| of.arms.iter().filter(|arm| of.is_outside(arm)).count();
        self.parameters.iter().map(of).sum()
    }
}

/// What 99.9 % of the deviations of arms that are alike are below, their scatter being known from themselves alone: fitted to
/// simulated normal populations of 6 to 100 arms.
#[expect(clippy::cast_precision_loss, reason = "arms")]
fn limit(arms: usize) -> f64 {
    3.3 + 40.0 / (arms as f64 - 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fixed sequence of numbers that are as good as normal: sums of twelve uniform ones.
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

    /// Arms with parameters of 100 ± 1 and ± 0.5 of its own.
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
            let outside = fleet.outside();
            assert!(1000 * outside < 2 * 200 * count, "{outside} of {count} arms");
            let mut worn = arms(count, 200);
            worn[1].parameters[3].value += 60.0;
            worn[2].parameters[4].value -= 200.0;
            let fleet = Fleet::new(worn).unwrap();
            let furthest = fleet.furthest();
            let found: Vec<_> = furthest
                .iter()
                .take(2)
                .map(|(of, arm)| (of.name.as_str(), arm.arm.as_str()))
                .collect();
            assert_eq!(found, [("p4", "arm 2"), ("p3", "arm 1")], "{count}");
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
        let of = &fleet.parameters[0];
        assert_eq!((of.median, of.scatter, of.limit), (4.0, NORMAL * 2.0, 3.3 + 8.0));
        // All alike to the last digit: what an arm's own uncertainty is decides.
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
        let mut lacking = arms(6, 2);
        lacking[3].parameters.remove(1);
        assert_eq!(Fleet::new(lacking).unwrap().parameters.len(), 1);
    }
}
