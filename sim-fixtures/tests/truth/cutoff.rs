//! What the position filter of IDIM-LS costs: smoothing at a low cut-off, noise at a high one.

use std::fmt::Write as _;

use super::cells::{Cell, Noise, Parameters};
use super::deviations::{Run, Summary};
use super::methods::least_squares;
use crate::common::experiment::experiment;
use crate::common::parallel::in_parallel;
use crate::common::table::{Column, Table, write_figure, writing};

const SEEDS: usize = 8;
const CUTOFFS_HZ: [f64; 6] = [25.0, 50.0, 100.0, 200.0, 400.0, 800.0];
const NOISES: [Noise; 2] = [Noise::Low, Noise::High];

/// One cut-off at one noise level.
struct Point {
    summary: Summary,
    /// What the verdict takes the largest bias for, in σ: the mean over the runs.
    expected: f64,
}

/// The best cut-off depends on the noise; what the verdict expects of the bias is what it is. A
/// cut-off that smooths and one that does not, unless the table is written.
#[test]
fn the_verdict_knows_what_the_position_filter_does() {
    let cutoffs_hz: &[f64] = if writing() { &CUTOFFS_HZ } else { &[50.0, 200.0] };
    let method = |&hz: &f64| least_squares("IDIM-LS", hz, |_| &[]);
    let methods: Vec<_> = cutoffs_hz.iter().map(method).collect();
    let cell = |noise| Cell { parameters: Parameters::Paper, noise, coloured: false };
    let (base, names) = (Parameters::Paper.base(), Parameters::Paper.names());
    let runs = in_parallel(NOISES.len() * SEEDS, |index| {
        let (noise, seed) = (NOISES[index / SEEDS], index % SEEDS + 1);
        let scenario = cell(noise).scenario(seed as u64);
        let experiment = experiment(&scenario);
        methods
            .iter()
            .map(|method: &super::methods::Method| {
                let estimate = (method.identify)(scenario.robot(), &base, &experiment, &names);
                let expected = estimate.position_bias.as_ref().unwrap().deviations.abs();
                (Run::new(&estimate, &scenario), expected)
            })
            .collect::<Vec<_>>()
    });
    let (mut points, mut rows) = (Vec::new(), Vec::new());
    for (noise, runs) in NOISES.into_iter().zip(runs.chunks(SEEDS)) {
        for (index, cutoff_hz) in cutoffs_hz.iter().enumerate() {
            let summary = Summary::new(runs.iter().map(|run| &run[index].0));
            let expected = runs.iter().map(|run| run[index].1).sum::<f64>() / SEEDS as f64;
            let (mean, name) = &summary.largest_mean;
            // The mean of 8 has a standard error of 0.35; the largest of 28 is beyond two of them
            // without any bias.
            if mean.abs() > 2.0 {
                let description =
                    format!("{noise:?}, {cutoff_hz} Hz: {expected} for {mean} of {name}");
                // It is in the combined uncertainty.
                assert!(
                    summary.within_2_combined >= 85.0,
                    "{description}: {}",
                    summary.within_2_combined
                );
                // Smoothing is expected to within a factor of two; of noise too much, which
                // saturates friction where the power law goes on.
                let most = if noise == Noise::Low { 2.0 } else { 10.0 };
                assert!((0.5..most).contains(&(expected / mean.abs())), "{description}");
            }
            rows.push(vec![
                if noise == Noise::Low { "low" } else { "high" }.to_owned(),
                format!("{cutoff_hz:.0}"),
                format!("{:.2}", summary.rms),
                format!("{mean:.2} {name}"),
                format!("{expected:.2}"),
                format!("{:.1}", summary.within_2_combined),
            ]);
            points.push(Point { summary, expected });
        }
    }
    let columns = vec![
        Column::exact("noise"),
        Column::exact("cut-off [Hz]"),
        Column::within("rms z", 0.02),
        Column::within("largest mean z", 0.05),
        Column::within("bias that the verdict expects [σ]", 0.05),
        Column::within("within 2 combined [%]", 0.02),
    ];
    let table = Table { document: "truth.md", name: "position filter", columns, rows };
    println!("{}", table.markdown());
    write_figure("position-filter.svg", || figure(&points));
    table.check_part(2);
}

const PANEL: (f64, f64) = (400.0, 260.0);
/// Room for the labels: left, top, right, bottom.
const MARGINS: [f64; 4] = [48.0, 56.0, 26.0, 40.0];
const LARGEST_Z: f64 = 10.0;
const SMALLEST_Z: f64 = 0.1;

/// Bias over cut-off, a panel per noise level, both scales logarithmic.
fn figure(points: &[Point]) -> String {
    let [left_margin, top, right, bottom] = MARGINS;
    let (width, height) = PANEL;
    let (wide, tall) = (width - left_margin - right, height - top - bottom);
    let [first, last] = [CUTOFFS_HZ[0], CUTOFFS_HZ[CUTOFFS_HZ.len() - 1]];
    let x = |hz: f64| left_margin + (hz / first).ln() / (last / first).ln() * wide;
    let y = |z: f64| {
        let z = z.clamp(SMALLEST_Z, LARGEST_Z);
        top + (LARGEST_Z / z).ln() / (LARGEST_Z / SMALLEST_Z).ln() * tall
    };
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {height}\" role=\"img\">\
         <title>Bias of IDIM-LS over the cut-off of its position filter</title><style>\
         text{{font:12px system-ui,sans-serif;fill:#1d2530}}.paper{{fill:#fff}}\
         .grid{{stroke:#d9dee5}}path{{fill:none;stroke-width:2}}.found{{stroke:#b3261e}}\
         .expected{{stroke:#3d7a4f;stroke-dasharray:5 3}}.limit{{stroke:#9fb3c8}}\
         @media screen and (prefers-color-scheme:dark){{text{{fill:#e4e8ed}}.paper{{fill:#14181d}}\
         .grid{{stroke:#333c46}}.found{{stroke:#ff8a73}}.expected{{stroke:#7fc796}}}}</style>\
         <rect class=\"paper\" width=\"{}\" height=\"{height}\"/>\n",
        2.0 * width,
        2.0 * width
    );
    for (panel, (noise, points)) in NOISES.iter().zip(points.chunks(CUTOFFS_HZ.len())).enumerate() {
        let name = if *noise == Noise::Low { "low noise" } else { "high noise" };
        writeln!(svg, "<g transform=\"translate({} 0)\">", panel as f64 * width).unwrap();
        writeln!(
            svg,
            "<text x=\"{left_margin}\" y=\"20\" font-weight=\"600\">{name}: largest bias of 28 \
             parameters [σ]</text><path class=\"found\" d=\"M{left_margin} 38h24\"/><text x=\"{}\" \
             y=\"42\">found</text><path class=\"expected\" d=\"M{} 38h24\"/><text x=\"{}\" \
             y=\"42\">expected by the verdict</text>",
            left_margin + 30.0,
            left_margin + 80.0,
            left_margin + 110.0
        )
        .unwrap();
        for z in [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0] {
            writeln!(
                svg,
                "<path class=\"grid\" style=\"stroke-width:1\" d=\"M{left_margin} {0:.1}h{wide}\"/>\
                 <text x=\"{1}\" y=\"{2:.1}\" text-anchor=\"end\">{z}</text>",
                y(z),
                left_margin - 6.0,
                y(z) + 4.0
            )
            .unwrap();
        }
        for hz in CUTOFFS_HZ {
            writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{hz} Hz</text>",
                x(hz),
                top + tall + 20.0
            )
            .unwrap();
        }
        let curve = |value: &dyn Fn(&Point) -> f64| {
            let points = CUTOFFS_HZ.iter().zip(points);
            let points = points.map(|(hz, point)| format!("{:.1} {:.1}", x(*hz), y(value(point))));
            format!("M{}", points.collect::<Vec<_>>().join("L"))
        };
        let figure = curve(&|point| point.summary.largest_mean.0.abs());
        let expected = curve(&|point| point.expected);
        writeln!(
            svg,
            "<path class=\"expected\" d=\"{expected}\"/><path class=\"found\" d=\"{figure}\"/></g>"
        )
        .unwrap();
    }
    svg + "</svg>\n"
}
