//! A digest of samples. It is equal for two results that were identified from the same samples.

use didim_dynamics::{JointSample, MAX_JOINTS};
use sha2::{Digest, Sha256};

use crate::text::to_hexadecimal;
use crate::window::Window;

/// Returns the SHA-256 over the samples of a window in hexadecimal digits.
///
/// The digest covers, for each sample in order: the motor positions and torques of the first eight
/// places (unused places are 0), a byte that is 1 if the sample has references, and the references
/// if it has them. It covers all `MAX_JOINTS` places if any value beyond the eighth is not 0, so
/// that arms with up to eight joints have the digests of earlier versions. Every number is an IEEE
/// 754 double in little endian, bit for bit. The number of samples (64 bits, little endian) comes
/// first. Time stamps and absolute sequence numbers are not included: a log stores only
/// microseconds and may start at another sequence number, but a replay of the same samples has to
/// give the same digest.
pub fn input_sha256(window: &Window) -> String {
    let places = match window.samples.iter().any(has_many_joints) {
        true => MAX_JOINTS,
        false => FIRST_PLACES,
    };
    let mut digest = Sha256::new();
    digest.update((window.samples.len() as u64).to_le_bytes());
    for sample in &window.samples {
        let positions_and_torques = [&sample.motor_position_rad, &sample.motor_torque_nm];
        positions_and_torques.into_iter().for_each(|values| add(&mut digest, &values[..places]));
        digest.update([u8::from(sample.has_reference)]);
        if sample.has_reference {
            add(&mut digest, &sample.motor_reference_rad[..places]);
        }
    }
    to_hexadecimal(digest)
}

/// Places that every digest covers.
const FIRST_PLACES: usize = 8;

fn has_many_joints(sample: &JointSample) -> bool {
    let JointSample { motor_position_rad, motor_torque_nm, motor_reference_rad, .. } = sample;
    let values = [motor_position_rad, motor_torque_nm, motor_reference_rad];
    values.into_iter().flat_map(|values| &values[FIRST_PLACES..]).any(|value| *value != 0.0)
}

fn add(digest: &mut Sha256, values: &[f64]) {
    values.iter().for_each(|value| digest.update(value.to_le_bytes()));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::window::WindowEnd;

    fn window(change: impl Fn(usize, &mut JointSample)) -> Window {
        let mut samples: Vec<_> = (7..10).map(|k| JointSample::zero(k, 1000 * k)).collect();
        for (k, sample) in samples.iter_mut().enumerate() {
            sample.motor_position_rad[0] = 0.1;
            sample.motor_torque_nm[5] = -2.5;
            change(k, sample);
        }
        Window {
            number: 0,
            sample_rate_hz: 1000.0,
            samples,
            counted_samples: 0..3,
            end: WindowEnd::Rest,
            recording_start: None,
            note: None,
        }
    }

    #[test]
    fn it_is_that_of_the_numbers_alone() {
        let plain = input_sha256(&window(|_, _| {}));
        // Eight places: python3 -c "import hashlib,struct as s; p=[.1]+7*[0.];
        // t=5*[0.]+[-2.5,0.,0.];
        // print(hashlib.sha256(s.pack('<Q',3)+3*(s.pack('<16d',*p,*t)+b'\\0')).hexdigest())"
        assert_eq!(plain, "119136d39783b59d9a0d1b262f7f0c5c63c7ad8977651541448e308a85dd11e2");
        let same = window(|k, sample| {
            sample.stamp_ns += 17;
            sample.sequence += 1_000_000;
            // Without its flag, a reference has no meaning.
            sample.motor_reference_rad[0] = k as f64;
        });
        assert_eq!(input_sha256(&same), plain);
    }

    #[test]
    fn every_number_every_flag_and_the_order_count() {
        let mut seen = vec![input_sha256(&window(|_, _| {}))];
        let changes: [fn(usize, &mut JointSample); 8] = [
            // The last bit of one number.
            |k, s| s.motor_position_rad[0] = if k == 1 { 0.1_f64.next_up() } else { 0.1 },
            |k, s| s.motor_torque_nm[5] = if k == 2 { 2.5 } else { -2.5 },
            |k, s| s.motor_torque_nm[5] = if k == 0 { 2.5 } else { -2.5 },
            |k, s| s.motor_position_rad[15] = if k == 1 { 0.1 } else { 0.0 },
            |k, s| s.motor_torque_nm[8] = if k == 1 { 0.1 } else { 0.0 },
            |_, s| s.has_reference = true,
            |k, s| s.has_reference = k == 0,
            |_, s| (s.has_reference, s.motor_reference_rad[3]) = (true, 1.0),
        ];
        for change in changes {
            let digest = input_sha256(&window(change));
            assert!(!seen.contains(&digest), "{digest}");
            seen.push(digest);
        }
        let mut shorter = window(|_, _| {});
        shorter.samples.pop();
        assert!(!seen.contains(&input_sha256(&shorter)));
    }
}
