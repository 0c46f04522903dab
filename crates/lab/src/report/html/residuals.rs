//! Check of the residuals for white noise, and the course of each iteration.

use didim_identification::identification::Fit;
use didim_identification::regression::autocorrelation;
use maud::{Markup, html};

use crate::comparison::Trial;
use crate::report::View;
use didim::report::convergence::draw_panel;
use didim::report::html::chart;
use didim::report::html::page::section as in_section;

pub(super) fn section(view: &View<'_>) -> Markup {
    let fits = view.comparison.methods.iter().filter_map(|of| Some((of.trial, of.fit.as_ref()?)));
    let content = html! {
        @for (trial, fit) in fits {
            details.method open {
                summary { (trial) ", " (fit.time_s.len()) " rows a joint" }
                (panels(trial, fit))
            }
        }
    };
    let explanation = "Autocorrelation of the residuals of each method, over the lag in rows. The \
                       band holds 95 % of the values that white noise behind the decimation filter \
                       has, or white noise itself where nothing was decimated.";
    in_section("Residuals", explanation, &content)
}

fn panels(trial: Trial, fit: &Fit) -> Markup {
    let lag_count = fit.white_noise.len();
    let autocorrelations: Vec<Vec<f64>> = fit
        .equation_residuals
        .iter()
        .map(|residual| autocorrelation(residual, lag_count))
        .collect();
    let range = chart::autocorrelation_range(&autocorrelations, &fit.white_noise);
    html! {
        div.panels { @for (k, found) in autocorrelations.iter().enumerate() {
            @let name = format!("joint {}", k + 1);
            figure { (chart::panel(
                &format!("Autocorrelation of the residual of {name}, {trial}"),
                |svg| chart::draw_autocorrelation(svg, &name, found, &fit.white_noise, range),
            )) }
        } }
    }
}

pub(super) fn convergence(view: &View<'_>) -> Markup {
    let steps = view.comparison.methods.iter().filter_map(|of| {
        let steps = &of.estimate.as_ref()?.convergence;
        (!steps.is_empty()).then_some((of.trial, steps))
    });
    let steps: Vec<_> = steps.collect();
    if steps.is_empty() {
        return html! {};
    }
    let content = html! {
        div.panels { @for (trial, steps) in steps { figure {
            figcaption { (trial) }
            (chart::panel(&format!("Convergence of {trial}"), |svg| draw_panel(svg, steps)))
        } } }
    };
    let explanation = "Each step simulates the closed loop with the parameters of the step before. \
                       The largest step is that of any parameter, in its standard deviations.";
    in_section("Convergence", explanation, &content)
}
