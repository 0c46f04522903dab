//! What it costs to take a held torque command for the torque of its instant.

use super::cells::{Cell, Noise, Parameters};
use super::methods::least_squares;
use crate::common::experiment::{experiment, hold_ignored};
use crate::common::parallel::in_parallel;
use crate::common::table::{Column, Table};

const SEEDS: usize = 10;
const CELL: Cell = Cell { parameters: Parameters::Paper, noise: Noise::Low, coloured: false };
/// Drive inertias; those of joints 1 and 2 are regrouped.
const INERTIAS: [&str; 6] = ["zz1r", "zz2r", "ia3", "ia4", "ia5", "ia6"];

/// One drive inertia in one run.
struct Figures {
    /// z with the hold honoured, and with it ignored.
    fixed: f64,
    ignored: f64,
    standard_deviation: f64,
}

/// A command from t_k to t_k + T is the torque of t_k + T/2. Taken for that of t_k, fv q̇ comes T/2
/// early, which is fv T/2 of inertia.
#[test]
fn ignoring_the_hold_biases_drive_inertias_and_the_default_does_not() {
    let method = least_squares("IDIM-LS, 200 Hz", 200.0, |_| &[]);
    let (base, names) = (CELL.parameters.base(), CELL.parameters.names());
    let runs = in_parallel(SEEDS, |index| {
        let scenario = CELL.scenario(index as u64 + 1);
        let honoured = experiment(&scenario);
        let ignored = hold_ignored(honoured.clone());
        let [fixed, ignored] = [honoured, ignored]
            .map(|experiment| (method.identify)(scenario.robot(), &base, &experiment, &names));
        INERTIAS.map(|name| {
            let truth = scenario.truth_of(name).unwrap();
            let inertia_of = |estimate: &didim_identification::identification::Estimate| {
                estimate.parameters.iter().find(|p| p.name == name).unwrap().clone()
            };
            let (fixed_value, ignored) = (inertia_of(&fixed), inertia_of(&ignored));
            let standard_deviation = fixed_value.standard_deviation;
            // Both in the same σ, so that their difference is the bias.
            let z = |value| (value - truth) / standard_deviation;
            Figures { fixed: z(fixed_value.value), ignored: z(ignored.value), standard_deviation }
        })
    });
    let scenario = CELL.parameters.scenario();
    let period_s = scenario.controller().timing.sample_period_s();
    let mut rows = Vec::new();
    for (index, name) in INERTIAS.into_iter().enumerate() {
        let mean = |figure: &dyn Fn(&Figures) -> f64| {
            runs.iter().map(|run| figure(&run[index])).sum::<f64>() / SEEDS as f64
        };
        let (fixed_value, ignored) = (mean(&|f| f.fixed), mean(&|f| f.ignored));
        let viscous = scenario.truth_of(&format!("fv{}", index + 1)).unwrap();
        let expected = mean(&|f| 0.5 * period_s * viscous / f.standard_deviation);
        // The mean of 10 has a standard error of 1.12/√10 = 0.35.
        assert!(fixed_value.abs() < 3.0 * 0.35, "{name}: {fixed_value}");
        // Coulomb friction, which comes early too, adds to the bias by viscous friction.
        assert!(
            ignored - fixed_value > 0.9 * expected && ignored > 5.0,
            "{name}: {ignored}, {expected}"
        );
        rows.push(vec![
            name.to_owned(),
            format!("{fixed_value:.2}"),
            format!("{ignored:.2}"),
            format!("{expected:.2}"),
        ]);
    }
    let columns = vec![
        Column::exact("drive inertia"),
        Column::within("mean z, hold honoured", 0.05),
        Column::within("mean z, hold ignored", 0.05),
        Column::within("fv T/2 in σ", 0.05),
    ];
    let table = Table { document: "truth.md", name: "hold", columns, rows };
    println!("{}", table.markdown());
    table.check();
}
