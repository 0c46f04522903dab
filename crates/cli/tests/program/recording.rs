//! The real recording of a TX40, and what an independent implementation of the same recipe makes of
//! it.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// Name, value and σ with the dead band, value and σ with tanh.
pub(crate) const EXPECTED: [(&str, f64, f64, f64, f64); 28] = [
    ("zz1r", 1.2804337, 0.00649, 1.2801374, 0.00615),
    ("fv1", 8.0486412, 0.0541, 7.9436151, 0.0528),
    ("fc1", 7.1494896, 0.155, 7.5159754, 0.153),
    ("xx2r", -0.49434967, 0.00983, -0.49250881, 0.00931),
    ("xz2r", -0.15935418, 0.00619, -0.15966821, 0.00587),
    ("zz2r", 1.0779967, 0.00642, 1.078535, 0.0061),
    ("mx2r", 2.170115, 0.0114, 2.1662604, 0.0109),
    ("fv2", 5.5307506, 0.061, 5.3938856, 0.0597),
    ("fc2", 8.1900772, 0.146, 8.6023058, 0.145),
    ("xx3r", 0.091103967, 0.00955, 0.090378978, 0.00906),
    ("zz3r", 0.13154334, 0.00534, 0.13216549, 0.00507),
    ("my3r", -0.58740908, 0.00911, -0.58862429, 0.00865),
    ("ia3", 0.078796639, 0.00375, 0.078569256, 0.00356),
    ("fv3", 1.9831916, 0.0309, 1.9321061, 0.0298),
    ("fc3", 6.3044889, 0.102, 6.5147179, 0.0988),
    ("mx4", -0.01759345, 0.00299, -0.017512998, 0.00293),
    ("ia4", 0.034189034, 0.00128, 0.034229065, 0.0013),
    ("fv4", 1.1014173, 0.0142, 1.0862491, 0.0146),
    ("fc4", 2.5195104, 0.0524, 2.5861569, 0.0543),
    ("my5r", -0.037716729, 0.00317, -0.036645227, 0.0031),
    ("ia5", 0.048901554, 0.00313, 0.048972611, 0.00313),
    ("fv5", 1.8534065, 0.0346, 1.8239627, 0.0353),
    ("fc5", 3.0510731, 0.0907, 3.136382, 0.0937),
    ("ia6", 0.011926916, 0.00069, 0.011909118, 0.000675),
    ("fv6", 0.66169559, 0.00933, 0.651209, 0.00924),
    ("fc6", 0.25829109, 0.0761, 0.26077188, 0.0767),
    ("fv_m6", 0.62596938, 0.00949, 0.61858346, 0.00939),
    ("fc_m6", 1.9010842, 0.0659, 1.965221, 0.0669),
];

/// What half a count of a motor's torque is at the joint, as a share of the residual there, at
/// most: gears of 32 to 48, counts of 3.5e-5 to 1.5e-4 N·m and the `rms` of the residuals \[N·m\].
///
/// Rounding adds a uniform error of standard deviation q/√12 to each torque. It moves an estimate
/// by no more than this share of its standard deviation, and by less, since the decimation filter
/// takes most of it away. The rounding of the positions, 6 µrad at the motor, is small against the
/// 1 mrad to which the recording itself was rounded.
pub(crate) fn rounding(rms_nm: &[f64]) -> f64 {
    let counts = [1.5e-4, 1.5e-4, 8.0e-5, 3.5e-5, 3.5e-5, 3.5e-5];
    let gears = [32.0, 32.0, 45.0, 48.0, 45.0, 32.0];
    assert_eq!(rms_nm.len(), counts.len());
    let shares = counts.iter().zip(gears).zip(rms_nm).map(|((q, n), rms)| n * q / rms);
    shares.fold(0.0, f64::max) / 12.0_f64.sqrt()
}

/// The folder of the data sets, which are not part of the project.
pub(crate) fn datasets() -> PathBuf {
    std::env::var_os("DIDIM_DATASETS").expect("DIDIM_DATASETS names the folder of the data").into()
}

/// Writes the recording as one CSV experiment without a time column.
pub(crate) fn write_csv(datasets: &Path, path: &Path) {
    let read = |name: &str| fs::read_to_string(datasets.join("tx40").join(name)).unwrap();
    let [position, torque, reference] =
        ["motor_position.csv", "motor_torque.csv", "motor_reference_reconstructed.csv"].map(read);
    let header = ["motor_position_rad", "motor_torque_nm", "motor_reference_rad"]
        .iter()
        .flat_map(|quantity| (1..=6).map(move |axis| format!("{quantity}_{axis}")));
    let mut csv = header.collect::<Vec<String>>().join(",") + "\n";
    let rows = position.lines().zip(torque.lines()).zip(reference.lines()).skip(1);
    for ((position, torque), reference) in rows {
        writeln!(csv, "{position},{torque},{reference}").unwrap();
    }
    fs::write(path, csv).unwrap();
}
