//! Descent within a domain: L-BFGS (Nocedal and Wright, *Numerical Optimization*, ch. 7.2).

/// Number of pairs of steps and gradient changes that represent the curvature.
const CURVATURE_PAIRS: usize = 20;
/// Smallest accepted decrease, as a share of the decrease that the gradient predicts.
const SUFFICIENT_DECREASE: f64 = 1e-4;
const MAX_HALVINGS: u32 = 30;
/// Length of the first step, in the units of the coordinates.
const FIRST_STEP: f64 = 0.05;

struct CurvaturePair {
    step: Vec<f64>,
    gradient_change: Vec<f64>,
    curvature: f64,
}

/// Takes at most `steps` steps of decreasing value, starting from `x`. `evaluate` returns the value
/// and fills the gradient; it returns `None` outside the domain. `after` is called with the point
/// after each step. Returns true if the start has a value.
pub(super) fn descend(
    x: &mut Vec<f64>,
    steps: u32,
    mut evaluate: impl FnMut(&[f64], &mut [f64]) -> Option<f64>,
    mut after: impl FnMut(&[f64]),
) -> bool {
    let mut gradient = vec![0.0; x.len()];
    let Some(mut value) = evaluate(x, &mut gradient) else { return false };
    let mut pairs: Vec<CurvaturePair> = Vec::new();
    let (mut next, mut next_gradient) = (x.clone(), gradient.clone());
    for _ in 0..steps {
        let mut direction = descent_direction(&pairs, &gradient);
        let mut slope = dot(&direction, &gradient);
        if slope.is_nan() || slope >= 0.0 {
            pairs.clear();
            direction = descent_direction(&pairs, &gradient);
            slope = dot(&direction, &gradient);
        }
        let mut length = 1.0;
        let mut accepted = None;
        for _ in 0..MAX_HALVINGS {
            for ((next, x), d) in next.iter_mut().zip(&*x).zip(&direction) {
                *next = x + length * d;
            }
            accepted = evaluate(&next, &mut next_gradient)
                .filter(|found| *found <= value + SUFFICIENT_DECREASE * length * slope);
            if accepted.is_some() {
                break;
            }
            length *= 0.5;
        }
        let Some(found) = accepted else {
            if pairs.is_empty() {
                break;
            }
            pairs.clear();
            continue;
        };
        let difference = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect();
        let step: Vec<f64> = difference(&next, x);
        let change: Vec<f64> = difference(&next_gradient, &gradient);
        let curvature = dot(&step, &change);
        if curvature > 1e-10 * (dot(&step, &step) * dot(&change, &change)).sqrt() {
            pairs.push(CurvaturePair { step, gradient_change: change, curvature });
            if pairs.len() > CURVATURE_PAIRS {
                pairs.remove(0);
            }
        }
        core::mem::swap(x, &mut next);
        core::mem::swap(&mut gradient, &mut next_gradient);
        value = found;
        after(x);
    }
    true
}

/// Returns the search direction, by the two-loop recursion.
fn descent_direction(pairs: &[CurvaturePair], gradient: &[f64]) -> Vec<f64> {
    let mut direction: Vec<f64> = gradient.iter().map(|g| -g).collect();
    let Some(last) = pairs.last() else {
        let norm = dot(gradient, gradient).sqrt();
        direction.iter_mut().for_each(|d| *d *= FIRST_STEP / norm.max(f64::MIN_POSITIVE));
        return direction;
    };
    let mut shares = Vec::with_capacity(pairs.len());
    for pair in pairs.iter().rev() {
        let share = dot(&pair.step, &direction) / pair.curvature;
        add(&mut direction, -share, &pair.gradient_change);
        shares.push(share);
    }
    let scale = last.curvature / dot(&last.gradient_change, &last.gradient_change);
    direction.iter_mut().for_each(|d| *d *= scale);
    for (pair, share) in pairs.iter().zip(shares.into_iter().rev()) {
        let back = dot(&pair.gradient_change, &direction) / pair.curvature;
        add(&mut direction, share - back, &pair.step);
    }
    direction
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add(to: &mut [f64], factor: f64, of: &[f64]) {
    to.iter_mut().zip(of).for_each(|(to, of)| *to += factor * of);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley behind a wall at x = 0.5. There is no value on the other side.
    #[test]
    fn a_minimum_at_a_wall_is_found() {
        let weight = 1e-6;
        let mut x = vec![-1.2, 1.0];
        assert!(descend(
            &mut x,
            200,
            |x: &[f64], gradient: &mut [f64]| {
                let [a, b] = [x[0], x[1]];
                let slack = 0.5 - a;
                if slack <= 0.0 {
                    return None;
                }
                gradient[0] = -2.0 * (1.0 - a) - 400.0 * a * (b - a * a) + weight / slack;
                gradient[1] = 200.0 * (b - a * a);
                Some((1.0 - a).powi(2) + 100.0 * (b - a * a).powi(2) - weight * slack.ln())
            },
            |_| ()
        ));
        assert!((x[0] - 0.5).abs() < 1e-4 && (x[1] - 0.25).abs() < 1e-3, "{x:?}");
    }
}
