//! Nothing wrong is called good, whatever hurts the record: over random combinations of damages, no
//! parameter of a result that is called good is further from the truth than five combined
//! uncertainties.

use std::ops::Range;

use didim::threads::Threads;
use didim_identification::parallel::map;
use didim_sim::fault_injection::InjectedFault;
use didim_sim::tx40_paper;

use super::bench::{Bench, assemble, cell, replay};
use super::draw::Draw;
use super::executed::FARTHEST;
use super::file::BusOf;
use crate::seeds::seeds;

/// In every test; `DIDIM_SEEDS=7` or `DIDIM_SEEDS=1000..6000` is for others.
const SEEDS: Range<u64> = 1..151;
/// One seed in so many has no damage.
const UNDAMAGED: u64 = 5;

/// What one seed comes to.
struct Run {
    seed: u64,
    faults: Vec<InjectedFault>,
    classes: Vec<String>,
    /// Of a result that is called good: the parameter furthest from the truth.
    farthest: Option<(String, f64)>,
}

#[test]
fn nothing_wrong_is_called_good_whatever_hurts_the_record() {
    let seeds = seeds(SEEDS);
    let count = usize::try_from(seeds.end - seeds.start).unwrap();
    let runs = map(&Threads::ALL, count, |index| run(seeds.start + index as u64));
    let mut wrong = Vec::new();
    for Run { seed, faults: fault_list, classes, farthest } in &runs {
        let (name, off) = farthest.as_ref().map_or(("", 0.0), |(name, off)| (name.as_str(), *off));
        if runs.len() <= 20 || off > FARTHEST {
            println!("{seed}: {classes:?} {name} {off:.2} {fault_list:?}");
        }
        if off > FARTHEST {
            wrong.push(*seed);
        }
    }
    let faultless = || runs.iter().filter(|run| run.faults.is_empty());
    let (count, good) =
        (faultless().count(), faultless().filter(|run| run.classes == ["yes"]).count());
    println!(
        "{} runs, {} damaged, {} of them called good, {} of these wrong: {wrong:?}; {good} of \
        {count} undamaged say yes",
        runs.len(),
        runs.len() - count,
        runs.iter().filter(|run| run.farthest.is_some() && !run.faults.is_empty()).count(),
        wrong.len(),
    );
    assert!(100 * good >= 95 * count, "{good} of {count} undamaged runs say yes");
    assert!(wrong.is_empty(), "called good, and more than {FARTHEST} uncertainties off: {wrong:?}");
}

fn run(seed: u64) -> Run {
    let mut draw = Draw::new(seed);
    let bench = Bench::new(tx40_paper().unwrap().with_seed(seed));
    let bus = if draw.below(4) == 0 { BusOf::Packed } else { BusOf::Sync };
    let fault_list = if seed.is_multiple_of(UNDAMAGED) { Vec::new() } else { draw.faults(bus) };
    let cell = cell(bus);
    let Some(frames) = bench.frames(bus, &fault_list) else {
        let classes = vec!["cannot be sent".to_owned()];
        return Run { seed, faults: fault_list, classes, farthest: None };
    };
    let outcomes = replay(cell, &assemble(cell, &frames).samples);
    let classes = outcomes.iter().map(|of| of.class().to_owned()).collect();
    let good = outcomes.iter().filter(|of| of.is_called_good());
    let farthest = good.map(|of| of.farthest(&bench.scenario));
    let farthest = farthest.max_by(|one, other| one.1.total_cmp(&other.1));
    Run { seed, faults: fault_list, classes, farthest }
}
