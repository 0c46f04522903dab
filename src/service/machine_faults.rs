//! Random combinations of faults of the machine in virtual time: four arms of different makers on
//! random motions, from the frames of a bus to results on a disk that forgets.
//!
//! Whatever happens, the following holds. A stored result stays, exactly once. A motion that no
//! fault touches has the result of a run without faults, bit by bit. No result that the verdict
//! accepts has a parameter further than five combined uncertainties from the truth. Every frame and
//! cycle is counted.

mod arm;
mod bus;
mod draw;
// As the simulated arm's tests have it.
#[path = "../../sim-fixtures/tests/common/parallel.rs"]
mod parallel;
mod stored;

use std::collections::{HashMap, VecDeque};
use std::ops::Range;
use std::rc::Rc;
use std::time::Duration;

use didim_drivers::assemble::Losses;
use didim_drivers::samples::{Assembled, Samples};
use didim_drivers::source::Received;
use didim_dynamics::JointSample;
use didim_identification::identification::Estimate;
use tempfile::TempDir;

use crate::analysis::identify::identify_window;
use crate::archive::Results;
use crate::archive::drift::DriftOptions;
use crate::archive::store::{Attachments, ResultRecord, Timestamp};
use crate::files::simulated::{Crash, DiskState, Failure, SimulatedDisk};
use crate::live::worker::{WindowEvent, Windower};
use crate::seeds::seeds;
use crate::text::sha256;
use crate::window::Window;
use arm::Motion;
use bus::{Bus, START_NS};
use draw::{MILLIONTH, MachineFault, Plan};
use parallel::in_parallel;
use stored::{Facts, configuration};

/// Largest distance of an accepted parameter from the truth, in combined uncertainties.
const FARTHEST: f64 = 5.0;
/// Results that are kept: more than a run has.
const RESULTS_KEPT: usize = 1_000;
/// Results that wait for the disk at most, as in the service.
const MAX_WAITING: usize = 32;
/// Between two attempts to store, as in the service \[ns\].
const RETRY_NS: u64 = 2_000_000_000;
/// Until a service that could not start is started again \[ns\].
const RESTART_NS: u64 = 5_000_000_000;
/// Time of samples that the stream keeps for a worker that is late \[ns\].
const BUFFER_NS: u64 = 20_000_000_000;

/// Time for which the clocks expect stamps of before a step \[ns\].
const STEP_MEMORY_NS: u64 = 3_000_000_000;

/// Result of a window: an estimate, or the reason why there is none.
type Outcome = Result<Estimate, String>;

/// Ends of the life of a process.
enum LifeEnd {
    Killed { away_ms: u64 },
    PowerLoss { away_ms: u64, remains: u64 },
    BusEnded,
}

/// One run of a plan.
struct Run {
    motion: Motion,
    bus: Bus,
    faults: VecDeque<(u64, MachineFault)>,
    folder: TempDir,
    base: DiskState,
    disk: Rc<SimulatedDisk>,
    /// End of the failure of the disk \[cycles\].
    disk_until: Option<u64>,
    configuration: &'static str,
    waiting: VecDeque<ResultRecord>,
    last_attempt: u64,
    facts: Facts,
    /// Cycles of which something is lost.
    disturbed: Vec<Range<u64>>,
    /// Outcomes by the content of their windows.
    outcome_by_content: HashMap<Vec<u64>, Outcome>,
    /// Outcomes with the motion in which the window was.
    outcomes: Vec<(u64, Outcome)>,
}

impl Run {
    fn new(plan: &Plan) -> Self {
        let motion = Motion::new(plan);
        let clean = motion.frames(None);
        let damaged = plan.damage.as_ref().map(|(at, fault)| (*at, motion.frames(Some(fault))));
        let bus = Bus::new(motion.period_ns, clean, damaged, plan.motions);
        let (length, cycles) = bus.state().lengths();
        let folder = tempfile::tempdir_in("/dev/shm").unwrap();
        let of_motion = |(at, _): &(u64, _)| at * length..(at + 1) * length;
        Self {
            faults: plan
                .faults
                .iter()
                .map(|(at, fault)| (at * cycles / MILLIONTH, *fault))
                .collect(),
            disk: SimulatedDisk::new(folder.path()),
            base: DiskState::of_folder(folder.path()),
            folder,
            disk_until: None,
            configuration: "first",
            waiting: VecDeque::new(),
            last_attempt: 0,
            facts: Facts::default(),
            disturbed: plan.damage.iter().map(of_motion).collect(),
            outcomes: Vec::new(),
            outcome_by_content: HashMap::new(),
            motion,
            bus,
        }
    }

    /// Returns the outcome of the motion without faults.
    fn reference(&mut self) -> Outcome {
        let mut assembler = self.motion.cell.bus().unwrap().assembler();
        let mut windower = self.windower();
        let mut outcome = Err("no window".to_owned());
        for frame in self.motion.frames(None).iter().flatten() {
            assembler.handle_frame(frame);
            while let Some(sample) = assembler.poll_sample() {
                if let Some(event) = windower.handle_sample(&sample) {
                    outcome = self.outcome(&event);
                }
            }
        }
        outcome
    }

    fn windower(&self) -> Windower {
        let cell = self.motion.cell;
        Windower::new(cell.window.plan(cell.sample_rate_hz()).unwrap())
    }

    /// Returns the outcome of a window. That of the same content is known.
    fn outcome(&mut self, event: &WindowEvent) -> Outcome {
        let window = match event {
            WindowEvent::Rejected(window) => return Err(window.rejection.cause().to_owned()),
            WindowEvent::Closed(window) => window,
        };
        let cell = &self.motion.cell;
        let identify = || match identify_window(cell, window) {
            Ok(identification) => Ok(identification.estimate),
            Err(error) => Err(error.to_string()),
        };
        self.outcome_by_content.entry(content_of(window)).or_insert_with(identify).clone()
    }

    /// Runs life after life until the bus ends; returns all problems.
    fn run(&mut self) -> Vec<String> {
        let disk = Rc::clone(&self.disk);
        let mut problems = disk.run(|| self.live());
        problems.extend(self.check_outcomes());
        problems
    }

    fn live(&mut self) -> Vec<String> {
        let mut problems = Vec::new();
        loop {
            let open = Results::open(self.folder.path(), RESULTS_KEPT, DriftOptions::default());
            let Ok(mut results) = open else {
                if self.disk_until.is_none() {
                    problems.push(format!("no start: {:?}", open.err()));
                    return problems;
                }
                self.be_away(RESTART_NS);
                self.heal_disk_when_due();
                continue;
            };
            problems.extend(self.facts.problems(self.folder.path()));
            let end = self.life(&mut results);
            drop(results);
            match end {
                LifeEnd::BusEnded => break,
                LifeEnd::Killed { away_ms } => self.be_away(1_000_000 * away_ms),
                LifeEnd::PowerLoss { away_ms, remains } => {
                    self.lose_power(remains);
                    self.be_away(1_000_000 * away_ms);
                }
            }
            self.facts.forget_unacknowledged();
            self.waiting.clear();
        }
        problems.extend(self.facts.problems(self.folder.path()));
        problems
    }

    /// Lets time pass without a process.
    fn be_away(&mut self, ns: u64) {
        let mut bus = self.bus.state();
        let (from, cycles) = (bus.next, bus.cycles_in(ns));
        bus.pass_unheard(cycles);
        self.disturbed.push(from..bus.next + 1);
    }

    /// Replaces the folder by the remains of a loss of power.
    fn lose_power(&mut self, remains: u64) {
        let mut state = self.base.clone();
        self.disk.changes().iter().for_each(|change| state.apply(change));
        let folder = tempfile::tempdir_in("/dev/shm").unwrap();
        state.write_remains(Crash::Random(remains), folder.path());
        self.base = DiskState::of_folder(folder.path());
        self.disk = SimulatedDisk::new(folder.path());
        self.disk.set();
        self.folder = folder;
        self.disk_until = None;
    }

    fn heal_disk_when_due(&mut self) {
        let (now, end) = self.bus.state().now_and_end();
        if self.disk_until.is_some_and(|until| now >= until.min(end)) {
            self.disk.heal();
            self.disk_until = None;
        }
    }

    /// One life of the process.
    fn life(&mut self, results: &mut Results) -> LifeEnd {
        let clocks = self.bus.clone();
        let assembler = self.motion.cell.bus().unwrap().assembler();
        let source = Box::new(self.bus.clone());
        let clocks = Box::new(move || clocks.clocks());
        let mut samples = Samples::with_clocks(clocks, source, assembler, 256);
        let mut windower = self.windower();
        // Samples up to this time are overwritten before the worker reads them.
        let mut blind_until_ns = 0;
        loop {
            self.heal_disk_when_due();
            while let Some((_, fault)) =
                self.faults.pop_front_if(|(at, _)| *at <= self.bus.state().next)
            {
                if let Some(end) = self.put_fault(fault, &mut windower) {
                    return end;
                }
            }
            let received = match samples.read(Duration::from_millis(20)) {
                Ok(received) => received,
                Err(error) => {
                    assert!(error.is_recoverable(), "{error}");
                    continue;
                }
            };
            while let Some(Assembled { sample, .. }) = samples.poll() {
                if sample.stamp_ns < blind_until_ns {
                    continue;
                }
                if let Some(event) = windower.handle_sample(&sample) {
                    let late_ns = self.handle_event(&event, results);
                    blind_until_ns = blind_until_ns.max(self.overwritten_until(late_ns));
                }
            }
            if self.is_retry_due() {
                let late_ns = self.store_waiting(results);
                blind_until_ns = blind_until_ns.max(self.overwritten_until(late_ns));
            }
            if received == Received::End {
                check_sums(samples.losses());
                self.end(results);
                return LifeEnd::BusEnded;
            }
        }
    }

    /// Returns the time up to which samples are overwritten before a worker reads them that was
    /// late by so much \[ns\], 0 if none is.
    fn overwritten_until(&mut self, late_ns: u64) -> u64 {
        let lost_ns = late_ns.saturating_sub(BUFFER_NS);
        if lost_ns == 0 {
            return 0;
        }
        let now_ns = self.bus.clocks().monotonic_ns;
        let bus = self.bus.state();
        let range = bus.next.saturating_sub(1)..bus.next + bus.cycles_in(lost_ns) + 1;
        self.disturbed.push(range);
        now_ns + lost_ns
    }

    /// Puts one fault on the machine. Returns the end of the process, if it is one.
    fn put_fault(&mut self, fault: MachineFault, windower: &mut Windower) -> Option<LifeEnd> {
        let mut bus = self.bus.state();
        let (from, cycles_in) = (bus.next, |ms: u64| bus.cycles_in(1_000_000 * ms));
        match fault {
            MachineFault::Kill { away_ms } => return Some(LifeEnd::Killed { away_ms }),
            MachineFault::PowerLoss { away_ms, remains } => {
                return Some(LifeEnd::PowerLoss { away_ms, remains });
            }
            MachineFault::EstimatorAway { away_ms } => {
                let cycles = cycles_in(away_ms);
                bus.pass_unheard(cycles);
                self.disturbed.push(from..bus.next + 1);
                drop(bus);
                *windower = self.windower();
            }
            MachineFault::Stop { for_ms } => {
                let cycles = cycles_in(for_ms);
                if bus.pass_stopped(cycles) > 0 {
                    self.disturbed.push(from..bus.next + 1);
                }
            }
            MachineFault::Interrupted { waits } => bus.interrupted += waits,
            MachineFault::ClockStep { by_ms } => {
                bus.set_wall(1_000_000 * by_ms);
                // Corrected: frames are read at the end of their cycle here, and a step within that
                // time moves stamps for as long as earlier ones may still arrive.
                if 1_000_000 * by_ms.unsigned_abs() <= self.motion.period_ns {
                    let until = from + bus.cycles_in(STEP_MEMORY_NS) + 1;
                    self.disturbed.push(from..until);
                }
            }
            MachineFault::InterfaceGone { for_ms } => {
                let cycles = cycles_in(for_ms).max(1);
                bus.take_interface(cycles);
                self.disturbed.push(from..from + cycles + 1);
            }
            MachineFault::DiskFull { for_ms } => {
                self.disk_until = Some(from + cycles_in(for_ms));
                self.disk.fail(Failure::Full);
            }
            MachineFault::DiskReadOnly { for_ms } => {
                self.disk_until = Some(from + cycles_in(for_ms));
                self.disk.fail(Failure::ReadOnly);
            }
            MachineFault::DiskLate { for_ms, change_ms } => {
                self.disk_until = Some(from + cycles_in(for_ms));
                self.disk.be_late(1_000_000 * change_ms);
            }
            MachineFault::Reload => {
                self.configuration = if self.configuration == "first" { "second" } else { "first" };
            }
        }
        None
    }

    /// Takes the outcome of a window, and stores it. Returns the time that the disk took \[ns\].
    fn handle_event(&mut self, event: &WindowEvent, results: &mut Results) -> u64 {
        let outcome = self.outcome(event);
        let WindowEvent::Closed(window) = event else { return 0 };
        self.outcomes.push((self.motion_of(window), outcome.clone()));
        let Ok(estimate) = outcome else { return 0 };
        let (sha256, _) = configuration(self.configuration);
        self.waiting.push_back(ResultRecord::new("cell", &sha256, window, estimate));
        if self.waiting.len() > MAX_WAITING {
            self.waiting.pop_front();
        }
        self.store_waiting(results)
    }

    /// Returns the motion in which the middle of a window is.
    fn motion_of(&self, window: &Window) -> u64 {
        let JointSample { stamp_ns, .. } = window.samples[window.samples.len() / 2];
        let bus = self.bus.state();
        bus.cycles_in(stamp_ns.saturating_sub(START_NS)) / bus.length()
    }

    fn is_retry_due(&self) -> bool {
        let bus = self.bus.state();
        !self.waiting.is_empty() && bus.next >= self.last_attempt + bus.cycles_in(RETRY_NS)
    }

    /// Stores the results that wait, in their order, until one is refused. Returns the time that
    /// the disk took \[ns\].
    fn store_waiting(&mut self, results: &mut Results) -> u64 {
        let unix_s = self.bus.state().unix_s();
        self.last_attempt = self.bus.state().next;
        results.settle();
        while let Some(record) = self.waiting.front() {
            let (_, texts) = stored::configuration_of(&record.configuration);
            let options = crate::archive::ResultOptions { texts, ..Default::default() };
            let (attachments, time) = (Attachments::default(), Timestamp::from_unix_s(unix_s));
            match results.store_result(record, &attachments, &options, time) {
                Ok(stored) => self.facts.add(stored),
                Err(_) => {
                    self.facts.refused += 1;
                    break;
                }
            }
            self.waiting.pop_front();
        }
        let (pending, _) = results.pending_count();
        self.facts.set_pending(pending);
        self.disk.take_late_ns()
    }

    /// The end of the run: the disk works, and everything that waits is stored.
    fn end(&mut self, results: &mut Results) {
        self.disk.heal();
        self.store_waiting(results);
        results.settle();
        let (pending, why) = results.pending_count();
        assert_eq!((pending, self.waiting.len()), (0, 0), "{why:?}");
        self.facts.set_pending(0);
    }

    /// Compares every outcome with the reference and the truth.
    fn check_outcomes(&mut self) -> Vec<String> {
        let mut problems = Vec::new();
        let reference = self.reference();
        let (length, cycles) = self.bus.state().lengths();
        let motions = cycles / length;
        for motion in 0..motions {
            let cycles = motion * length..(motion + 1) * length;
            let meets = |range: &Range<u64>| range.start < cycles.end && cycles.start < range.end;
            if self.disturbed.iter().any(meets) {
                continue;
            }
            let own: Vec<&Outcome> =
                self.outcomes.iter().filter(|(at, _)| *at == motion).map(|(_, of)| of).collect();
            let is_equal = match (&own[..], &reference) {
                ([Ok(own)], Ok(reference)) => format!("{own:?}") == format!("{reference:?}"),
                ([Err(own)], Err(reference)) => own == reference,
                ([], Err(_)) => true,
                _ => false,
            };
            if !is_equal {
                problems
                    .push(format!("motion {motion} is not touched, and differs: {}", own.len()));
            }
        }
        let all = self.outcomes.iter().map(|(_, outcome)| outcome).chain([&reference]);
        for estimate in all.filter_map(|outcome| outcome.as_ref().ok()) {
            let uses = &estimate.verdict.uses;
            let is_accepted = [&uses.prediction, &uses.physical_values]
                .iter()
                .any(|of| of.applicable == Some(true));
            let (name, off) = self.farthest(estimate);
            if is_accepted && off > FARTHEST {
                problems.push(format!("accepted, and {name} is off by {off:.1} uncertainties"));
            }
        }
        problems
    }

    /// Returns the parameter that is furthest from the truth, with its distance in combined
    /// uncertainties.
    fn farthest(&self, estimate: &Estimate) -> (String, f64) {
        let off = estimate.parameters.iter().filter_map(|parameter| {
            let truth = self.motion.scenario.truth_of(&parameter.name)?;
            let off = (parameter.value - truth) / parameter.combined_standard_deviation;
            Some((parameter.name.clone(), off.abs()))
        });
        off.max_by(|one, other| one.1.total_cmp(&other.1)).unwrap_or_default()
    }
}

/// Returns all numbers of a window that the identification uses.
fn content_of(window: &Window) -> Vec<u64> {
    let counted = [window.counted_samples.start as u64, window.counted_samples.end as u64];
    let of_sample = |sample: &JointSample| {
        let signals =
            [sample.motor_position_rad, sample.motor_torque_nm, sample.motor_reference_rad];
        signals.into_iter().flatten().map(f64::to_bits).chain([sample.has_reference.into()])
    };
    counted.into_iter().chain(window.samples.iter().flat_map(of_sample)).collect()
}

/// Every frame and every cycle of a bus that has ended is counted.
fn check_sums(losses: &Losses) {
    // Targets of the next cycle wait for it.
    let counted = losses.frames_used + losses.frames.total();
    assert!((0..16).contains(&(losses.frames_received - counted)), "{losses:?}");
    assert_eq!(losses.cycles_begun, losses.samples + losses.cycles.total(), "{losses:?}");
}

/// In every run of the tests; `DIDIM_SEEDS=7` or `DIDIM_SEEDS=1000..3000` is for others.
const SEEDS: Range<u64> = 0..50;

/// Prints what came of one seed, and returns its problems.
fn run_seed(seed: u64, is_printed: bool) -> (Vec<String>, usize, usize) {
    let plan = Plan::draw(seed);
    let mut run = Run::new(&plan);
    let problems = run.run();
    let accepted =
        run.outcomes.iter().filter(|(_, of)| of.as_ref().is_ok_and(|of| of.verdict.applicable));
    let accepted = accepted.count();
    if is_printed || !problems.is_empty() {
        let outcomes: Vec<String> = run
            .outcomes
            .iter()
            .map(|(at, of)| match of {
                Ok(of) => format!("{at}: {} {:.1}", of.verdict.applicable, run.farthest(of).1),
                Err(why) => format!("{at}: {why}"),
            })
            .collect();
        println!("{seed}: {plan:?}\n  {outcomes:?} {} stored", run.facts.stored());
    }
    let problems = problems.into_iter().map(|problem| format!("{seed}: {problem}")).collect();
    (problems, run.facts.stored(), accepted)
}

#[test]
fn no_fault_of_the_machine_costs_a_stored_result_or_changes_another() {
    let seeds = seeds(SEEDS);
    let count = usize::try_from(seeds.end - seeds.start).unwrap();
    let is_printed = count <= 10;
    let found = in_parallel(count, |index| run_seed(seeds.start + index as u64, is_printed));
    let problems: Vec<&String> = found.iter().flat_map(|(problems, ..)| problems).collect();
    let [stored, accepted] =
        [found.iter().map(|of| of.1).sum::<usize>(), found.iter().map(|of| of.2).sum()];
    println!(
        "{count} runs, {stored} results stored, {accepted} of the results usable, {} problems",
        problems.len()
    );
    assert!(problems.is_empty(), "{problems:#?}");
    assert!(stored > 0 || is_printed);
}

/// The draw is fixed before the runs: the plans of the first seeds, as text.
#[test]
fn the_draw_is_the_committed_one() {
    let plans: Vec<String> = (0..10_000).map(|seed| format!("{:?}\n", Plan::draw(seed))).collect();
    assert_eq!(sha256(&[&plans.concat()]), DRAW_SHA256);
}

/// Hash of the plans of the seeds 0 to 9,999.
const DRAW_SHA256: &str = "88e051a2a6237239ad7e55507f564c8102d98505550018208c5b6a8d3d6934cb";
