//! Low-pass filter by its modes (partial-fraction expansion), for one pass and for a forward and a
//! backward pass.

use nalgebra::Complex;

use super::sections::SecondOrderSections;

/// Pole p that is real, or one pole of a conjugate pair that represents both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mode {
    pub(super) pole: Complex<f64>,
    /// 1 − p, stored separately to keep its precision if p is close to 1.
    one_minus_pole: Complex<f64>,
    /// Amplitude r of the pole in one pass.
    one_pass_amplitude: Complex<f64>,
    /// Amplitude c of the pole in a forward and a backward pass.
    two_pass_amplitude: Complex<f64>,
    /// Response H(1/p).
    mirrored_response: Complex<f64>,
    /// Number of represented poles: 1, or 2 for a pair.
    poles: f64,
}

/// Filter represented by its poles (partial fractions of Oppenheim & Schafer, *Discrete-Time Signal
/// Processing*, section 3.3):
///
/// ```text
/// forward                h_0 = K        h_m = Σ r p^(m−1)
/// forward and backward   g_0 = Σ h_m²   g_m = Σ c p^(|m|−1)        c = r H(1/p)
/// ```
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Modes {
    /// Gain K.
    direct_gain: f64,
    /// Central coefficient g_0 of both passes.
    pub(super) centre_gain: f64,
    pub(super) modes: Vec<Mode>,
}

impl Modes {
    /// Creates the modes of `H(z) = K Π (1 + z⁻¹)/(1 − p z⁻¹)`, whose poles differ.
    pub(super) fn from_sections(filter: &SecondOrderSections) -> Self {
        let direct: f64 = filter.sections.iter().map(|section| section.b[0]).product();
        let distances: Vec<(Complex<f64>, f64)> = (filter.sections.iter())
            .map(|section| {
                let [a1, a2] = section.a;
                if section.is_first_order() {
                    return (Complex::from(1.0 + a1), 1.0);
                }
                // Solution of q² − (2 + a1) q + (1 + a1 + a2) = 0 for q = 1 − p.
                let half = 0.5 * (2.0 + a1);
                (Complex::new(half, -((1.0 + a1 + a2) - half * half).max(0.0).sqrt()), 2.0)
            })
            .collect();
        let all_modes: Vec<Complex<f64>> = (distances.iter())
            .flat_map(|&(q, poles)| [Some(q), (poles > 1.0).then_some(q.conj())])
            .flatten()
            .collect();
        let zeros =
            |q: Complex<f64>| all_modes.iter().fold(Complex::from(direct), |z, _| z * (2.0 - q));
        let mode = |&(q, poles): &(Complex<f64>, f64)| {
            let others = all_modes.iter().filter(|other| **other != q);
            let forward = others.fold(zeros(q), |share, other| share / (other - q));
            let mirrored =
                all_modes.iter().fold(zeros(q), |h, other| h / one_less_product(q, *other));
            Mode {
                pole: 1.0 - q,
                one_minus_pole: q,
                one_pass_amplitude: forward,
                two_pass_amplitude: forward * mirrored,
                mirrored_response: mirrored,
                poles,
            }
        };
        let modes: Vec<Mode> = distances.iter().map(mode).collect();
        let mut filter = Self { direct_gain: direct, centre_gain: 0.0, modes };
        // Σ h_m² = K² + Σ r Σ_m p^m h_(m+1).
        let forward: Vec<_> = filter.modes.iter().map(|mode| mode.one_pass_amplitude).collect();
        let energy = filter.modes.iter().map(|mode| {
            mode.poles * (mode.one_pass_amplitude * filter.overlap_sum(mode, &forward)).re
        });
        filter.centre_gain = direct * direct + energy.sum::<f64>();
        filter
    }

    /// Returns `Σ_m p^m x_m` with the sum x_m of all modes, one amplitude each.
    fn overlap_sum(&self, mode: &Mode, amplitudes: &[Complex<f64>]) -> Complex<f64> {
        let amplitude_of = |amplitude, q| amplitude / one_less_product(mode.one_minus_pole, q);
        let terms = self.modes.iter().zip(amplitudes).map(|(other, amplitude)| {
            let response = amplitude_of(*amplitude, other.one_minus_pole);
            if other.poles > 1.0 {
                response + amplitude_of(amplitude.conj(), other.one_minus_pole.conj())
            } else {
                response
            }
        });
        terms.sum()
    }

    /// Returns `g_0 − Σ c/p`. This is the direct contribution of sample k + 1 to y[k+1] − y[k−1],
    /// in addition to that of the modes.
    pub(super) fn flank_gain(&self) -> f64 {
        self.centre_gain
            - self.modes.iter().map(|mode| (mode.real_amplitude() / mode.pole).re).sum::<f64>()
    }

    /// Returns the output of one pass for a sample and for the mode states of the samples before
    /// it.
    pub(super) fn one_pass_output(&self, sample: f64, states: &[Complex<f64>]) -> f64 {
        let shares = self.modes.iter().zip(states);
        self.direct_gain * sample
            + shares
                .map(|(mode, state)| mode.poles * (mode.one_pass_amplitude * state).re)
                .sum::<f64>()
    }

    /// Returns the states with which the backward pass starts. They correspond to a forward pass
    /// that ends with `states` and then outputs `end_value` forever. A backward pass over the
    /// samples alone that starts with these states has the same result.
    pub(super) fn backward_states(
        &self,
        end_value: f64,
        states: &[Complex<f64>],
    ) -> Vec<Complex<f64>> {
        let decaying: Vec<_> = self
            .modes
            .iter()
            .zip(states)
            .map(|(mode, state)| mode.one_pass_amplitude * state)
            .collect();
        let backward = self.modes.iter().map(|mode| {
            (mode.settled_state() * end_value - self.overlap_sum(mode, &decaying))
                / mode.mirrored_response
        });
        backward.collect()
    }
}

impl Mode {
    /// Returns `Σ p^(m−1)` over the past of a constant 1.
    pub(super) fn settled_state(&self) -> Complex<f64> {
        self.one_minus_pole.inv()
    }

    /// Returns the contribution of c to a real signal. For a conjugate pair it is twice that of one
    /// pole; the caller takes the real part.
    pub(super) fn real_amplitude(&self) -> Complex<f64> {
        self.two_pass_amplitude * self.poles
    }

    /// Returns p − 1/p, computed from 1 − p to keep its precision.
    pub(super) fn step_across(&self) -> Complex<f64> {
        -self.one_minus_pole * (2.0 - self.one_minus_pole) / self.pole
    }
}

/// Returns 1 − p p', computed from q = 1 − p and `other` = 1 − p' to keep its precision.
fn one_less_product(q: Complex<f64>, other: Complex<f64>) -> Complex<f64> {
    q + other - q * other
}
