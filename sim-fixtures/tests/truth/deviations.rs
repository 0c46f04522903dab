//! How far estimates are from the truth, in standard deviations.

use didim_identification::identification::Estimate;
use didim_sim::Scenario;

/// One estimate against the truth.
pub(crate) struct Run {
    /// z = (value − truth)/σ of every parameter, by name.
    pub(crate) deviations: Vec<(String, f64)>,
    /// Parameters within two combined uncertainties of the truth.
    covered: usize,
    /// Σ z² with the classical σ.
    classical: f64,
    pub(crate) applicable: bool,
}

impl Run {
    pub(crate) fn new(estimate: &Estimate, scenario: &Scenario) -> Self {
        let deviations: Vec<(String, f64)> = estimate
            .parameters
            .iter()
            .map(|p: &didim_identification::identification::ParameterEstimate| {
                let truth = scenario.truth_of(&p.name).unwrap();
                (p.name.clone(), (p.value - truth) / p.standard_deviation)
            })
            .collect();
        let classical = (deviations.iter().zip(&estimate.parameters))
            .map(|((_, z), p)| (z * p.standard_deviation / p.classical_standard_deviation).powi(2))
            .sum();
        let covered = deviations.iter().zip(&estimate.parameters);
        let covered = covered
            .filter(|((_, z), p)| {
                (z * p.standard_deviation).abs() <= 2.0 * p.combined_standard_deviation
            })
            .count();
        Self { deviations, covered, classical, applicable: estimate.verdict.applicable }
    }
}

/// What an honest standard deviation and an estimate without bias keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Limit {
    /// Root mean square of z from 0.9 to 1.1.
    Rms,
    /// 92 to 98 % of |z| within 2; normal noise has 95.4.
    Within2,
    /// At least 99 % within 3; normal noise has 99.7.
    Within3,
    /// |mean z| of every parameter at most 0.7. Of 40 runs the mean is known to 0.16.
    Mean,
}

impl Limit {
    pub(crate) const ALL: [Self; 4] = [Self::Rms, Self::Within2, Self::Within3, Self::Mean];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Rms => "rms",
            Self::Within2 => "2 σ",
            Self::Within3 => "3 σ",
            Self::Mean => "mean",
        }
    }
}

/// Figures of many runs of one cell by one method.
#[derive(Debug)]
pub(crate) struct Summary {
    /// Root mean square of z, over parameters and runs.
    pub(crate) rms: f64,
    /// The same with the classical σ.
    pub(crate) classical_rms: f64,
    /// Share of |z| ≤ 2 and |z| ≤ 3 \[%\].
    pub(crate) within_2: f64,
    pub(crate) within_3: f64,
    /// The largest |mean z| of a parameter over the runs, and which one.
    pub(crate) largest_mean: (f64, String),
    /// Root mean square over the parameters of the standard deviation of z about its mean: what
    /// the rms would be without bias.
    pub(crate) scatter: f64,
    /// Share of parameters within two combined uncertainties of the truth \[%\].
    pub(crate) within_2_combined: f64,
    /// Runs that were called applicable.
    pub(crate) applicable: usize,
}

impl Summary {
    pub(crate) fn new<'a>(runs: impl Iterator<Item = &'a Run>) -> Self {
        let runs: Vec<_> = runs.collect();
        let deviations: Vec<f64> =
            runs.iter().flat_map(|run| run.deviations.iter().map(|(_, z)| *z)).collect();
        let share = |limit: f64| {
            100.0 * deviations.iter().filter(|z| z.abs() <= limit).count() as f64
                / deviations.len() as f64
        };
        let count = runs.len() as f64;
        let names: Vec<&String> = runs[0].deviations.iter().map(|(name, _)| name).collect();
        let mean = |index: usize| -> f64 {
            runs.iter().map(|run| run.deviations[index].1).sum::<f64>() / count
        };
        let means: Vec<f64> = (0..names.len()).map(mean).collect();
        let mean_square = deviations.iter().map(|z| z * z).sum::<f64>() / deviations.len() as f64;
        let squared_mean = means.iter().map(|m| m * m).sum::<f64>() / means.len() as f64;
        let (index, _) = (means.iter().enumerate())
            .max_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs()))
            .unwrap();
        Self {
            rms: mean_square.sqrt(),
            classical_rms: {
                let sum: f64 = runs.iter().map(|run| run.classical).sum();
                (sum / deviations.len() as f64).sqrt()
            },
            within_2: share(2.0),
            within_3: share(3.0),
            largest_mean: (means[index], names[index].clone()),
            within_2_combined: {
                let covered: usize = runs.iter().map(|run| run.covered).sum();
                100.0 * covered as f64 / deviations.len() as f64
            },
            // (count / (count − 1)) makes the variance about an estimated mean unbiased.
            scatter: ((mean_square - squared_mean) * count / (count - 1.0)).sqrt(),
            applicable: runs.iter().filter(|run| run.applicable).count(),
        }
    }

    /// The limits that are not kept.
    pub(crate) fn missed(&self) -> Vec<Limit> {
        let is_within = |limit: &Limit| match limit {
            Limit::Rms => (0.9..=1.1).contains(&self.rms),
            Limit::Within2 => (92.0..=98.0).contains(&self.within_2),
            Limit::Within3 => self.within_3 >= 99.0,
            Limit::Mean => self.largest_mean.0.abs() <= 0.7,
        };
        Limit::ALL.into_iter().filter(|limit| !is_within(limit)).collect()
    }
}
