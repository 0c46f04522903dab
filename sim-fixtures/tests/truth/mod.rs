//! The simulated arm's parameters are known: what do the methods make of them, and do their
//! standard deviations say how wrong they are? docs/evidence/truth.md shows the tables.

mod arms;
mod cells;
mod combined;
mod cutoff;
mod deviations;
mod exact;
mod hold;
mod methods;
mod model_errors;
mod monitoring;
mod statements;

use crate::common::experiment::experiment;
use crate::common::parallel::in_parallel;
use crate::common::table::{Column, Table, writing};
use cells::Cell;
use deviations::{Limit, Run, Summary};
use methods::methods;

/// Seeds 1 to this many, unless `DIDIM_STUDY_SEEDS` says otherwise.
const SEEDS: usize = 40;

/// The first alone where the study is not written: it tells whether the table is of this code.
fn seeds() -> usize {
    match std::env::var("DIDIM_STUDY_SEEDS") {
        Ok(text) => text.parse().expect("DIDIM_STUDY_SEEDS is a number"),
        Err(_) if writing() => SEEDS,
        Err(_) => 1,
    }
}

/// Every cell by every method: z of all parameters over all seeds, held to the limits where the
/// table is written.
#[test]
fn standard_deviations_say_how_far_the_truth_is() {
    let (cells, methods, seeds) = (Cell::read_all(), methods(), seeds());
    let arms: Vec<_> = cells.iter().map(|c| (c.parameters.base(), c.parameters.names())).collect();
    let runs = in_parallel(cells.len() * seeds, |index| -> Vec<Run> {
        let (cell, seed) = (index / seeds, index % seeds + 1);
        let scenario = cells[cell].scenario(seed as u64);
        let experiment = experiment(&scenario);
        let (base, names) = &arms[cell];
        methods
            .iter()
            .map(|method: &methods::Method| {
                let estimate = (method.identify)(scenario.robot(), base, &experiment, names);
                Run::new(&estimate, &scenario)
            })
            .collect()
    });
    let (mut rows, mut not_excused) = (Vec::new(), Vec::new());
    for (cell, runs) in cells.iter().zip(runs.chunks(seeds)) {
        for (index, method) in methods.iter().enumerate() {
            let summary = Summary::new(runs.iter().map(|by_method| &by_method[index]));
            let mut row = cell.columns().to_vec();
            let missed = summary.missed();
            let excused = (method.excused)(*cell);
            // What is biased has to be within the combined uncertainty.
            let is_covered =
                summary.largest_mean.0.abs() <= 0.7 || summary.within_2_combined >= 95.0;
            if !is_covered || !missed.iter().all(|limit| excused.contains(limit)) {
                not_excused.push(format!("{row:?}, {}: {missed:?} {summary:?}", method.name));
            }
            let missed: Vec<_> = missed.into_iter().map(Limit::name).collect();
            let first = Summary::new(runs[..1].iter().map(|by_method| &by_method[index]));
            row.extend([
                method.name.to_owned(),
                format!("{:.4}", first.rms),
                format!("{:.2}", summary.classical_rms),
                format!("{:.2}", summary.rms),
                format!("{:.2}", summary.scatter),
                format!("{:.1}", summary.within_2),
                format!("{:.1}", summary.within_3),
                format!("{:.2} {}", summary.largest_mean.0, summary.largest_mean.1),
                format!("{} of {seeds}", summary.applicable),
                if missed.is_empty() { "none".to_owned() } else { missed.join(", ") },
            ]);
            rows.push(row);
        }
    }
    let columns = vec![
        Column::exact("parameters"),
        Column::exact("noise"),
        Column::exact("disturbance"),
        Column::exact("method"),
        // Differs by rounding between processors.
        Column::within("rms z of seed 1", 0.001),
        Column::of_the_whole("rms z, classical σ"),
        Column::of_the_whole("rms z"),
        Column::of_the_whole("scatter"),
        Column::of_the_whole("within 2 σ [%]"),
        Column::of_the_whole("within 3 σ [%]"),
        Column::of_the_whole("largest mean z"),
        Column::of_the_whole("applicable"),
        Column::of_the_whole("limits missed"),
    ];
    let table = Table { document: "truth.md", name: "study", columns, rows };
    println!("{}", table.markdown());
    // Fewer seeds know less than the limits ask for, others are not those of the document.
    if seeds >= SEEDS {
        assert!(not_excused.is_empty(), "limits missed:\n{}", not_excused.join("\n"));
    }
    if seeds == SEEDS || seeds == 1 {
        table.check();
    }
}
