//! Gains: the numbers, the units they are checked against, and what is refused.

use std::f64::consts::{SQRT_2, TAU};

use crate::common::bus::{DRIVES, drives, packed_drives};
use crate::common::{cia402, cia402_dbc, compile, packed};
use didim_drivers::layout::{CompiledLayout, CycleValues, Role};
use didim_drivers::units::{DriveSpec, Scales, UnitsError};
use proptest::prelude::*;

const TORQUE: &str = "{ per_mille_of_rated_torque = { rated_torque_nm = 2.0 } }";

fn scales(text: &str) -> Result<Scales, UnitsError> {
    Scales::new(&drives(text, 6), &cia402())
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * (1.0 + b.abs())
}

#[test]
fn counts_are_angles_by_sign_scale_and_zero() {
    let text = DRIVES.replace("sign = 1, zero = 0", "sign = -1, zero = 100.0");
    let scales = scales(&text).unwrap();
    assert!(close(scales.position_rad(3, 100.0 + 2048.0), -TAU / 4.0));
    assert!(close(scales.reference_rad(3, 100.0 - 8192.0, 0.0), TAU));
    let per_count = DRIVES.replace("counts_per_revolution = 8192", "rad_per_count = 0.25");
    assert!(close(self::scales(&per_count).unwrap().position_rad(0, -8.0), -2.0));
}

/// A drive with a position in turns.
const TURNS: &str = "position = { scale = SCALE, sign = 1, zero = 0.5, wraps = \"refuse\", \
    provenance = \"a\" }\ntorque = { scale = \"nm\", sign = 1, provenance = \"a\" }";

/// Drives that number themselves from 0 and count turns, as an ODrive does.
#[test]
fn turns_of_drives_that_count_from_0_are_angles() {
    let message = |index: usize| {
        format!(
            "BO_ {} Axis{index}_State: 6 Drive\n \
            SG_ Pos : 0|32@1- (0.25,0) [0|0] \"rev\" Controller\n \
            SG_ Trq : 32|16@1- (1,0) [0|0] \"Nm\" Controller\n",
            385 + index
        )
    };
    let head = "VERSION \"\"\nNS_ :\nBS_:\nBU_: Drive Controller\nBO_ 128 SYNC: 0 Controller\n";
    let dbc = format!("{head}{}{}", message(0), message(1));
    let spec = "axes = 2\nrate_hz = 500.0\nsync = \"SYNC\"\n\
        position = { signal = \"Axis{index}_State.Pos\", valid = \"instant\" }\n\
        torque = { signal = \"Axis{index}_State.Trq\", valid = \"instant\" }\n";
    let layout = CompiledLayout::compile(&dbc, &toml::from_str(spec).unwrap()).unwrap();
    let drive =
        |scale: &str| -> DriveSpec { toml::from_str(&TURNS.replace("SCALE", scale)).unwrap() };
    let drives = |scale: &str| Scales::new(&[drive(scale), drive(scale)], &layout);
    assert!(close(drives("\"rev\"").unwrap().position_rad(1, 1.75), 1.25 * TAU));
    let error = drives("\"rad\"").unwrap_err();
    assert!(matches!(error, UnitsError::WrongUnit { .. }), "{error}");
}

#[test]
fn a_factor_corrects_the_scale() {
    let text = DRIVES
        .replace("sign = 1, zero = 0", "sign = -1, factor = 0.5, zero = 100.0")
        .replace(TORQUE, &format!("{TORQUE}, factor = 1.25"));
    let scales = scales(&text).unwrap();
    assert!(close(scales.position_rad(3, 100.0 + 2048.0), -TAU / 8.0));
    assert!(close(scales.position_value(3, -TAU / 8.0), 100.0 + 2048.0));
    assert!(close(scales.reference_rad(3, 100.0 - 8192.0, 0.0), TAU / 2.0));
    assert!(close(scales.torque_nm(0, 250.0), 0.25 * 2.0 * 1.25));
    assert!(close(scales.torque_value(0, 0.625), 250.0));
    assert!(close(scales.position_per_rad(3), -16_384.0 / TAU));
    // The hash of a configuration is that of what is written.
    let written = toml::to_string(&drives(&text, 1)[0]).unwrap();
    assert_eq!(written.matches("factor = ").count(), 2, "{written}");
    let written = toml::to_string(&drives(DRIVES, 1)[0]).unwrap();
    assert_eq!(written.matches("factor = ").count(), 0, "{written}");
}

#[test]
fn a_rated_current_says_which_value_it_is() {
    for (current, constant, factor) in [
        ("rms", "rms", 1.0),
        ("peak", "peak", 1.0),
        ("rms", "peak", SQRT_2),
        ("peak", "rms", 1.0 / SQRT_2),
    ] {
        let scale = format!(
            "{{ per_mille_of_rated_current = {{ rated_current_a = 5.0, current_is = \"{current}\", \
             torque_constant_nm_per_a = 0.8, torque_constant_is = \"{constant}\" }} }}"
        );
        let scales = scales(&DRIVES.replace(TORQUE, &scale)).unwrap();
        assert!(close(scales.torque_nm(0, 250.0), 0.25 * 5.0 * 0.8 * factor));
    }
}

#[test]
fn a_unit_that_the_gain_does_not_expect_is_refused() {
    let error = scales(&DRIVES.replace(TORQUE, "\"nm\"")).unwrap_err();
    assert_eq!(
        error.to_string(),
        "drive 1: the gain expects \"Nm\" or \"N·m\" or \"N.m\" or \"N*m\", and \
         `TPDO1_1.TorqueDemand` of the DBC file is in \"per mille\"; choose the scale for \
         that unit, or correct the unit in the DBC file"
    );
    let rad = DRIVES.replace("{ counts_per_revolution = 8192 }", "\"rad\"");
    assert!(
        matches!(scales(&rad), Err(UnitsError::WrongUnit { axis, .. }) if axis.position() == 0)
    );
    // The reference has to be in the unit of the position.
    let dbc = cia402_dbc().replace(
        "SG_ TargetPosition : 16|32@1- (1,0) [-2147483648|2147483647] \"count\"",
        "SG_ TargetPosition : 16|32@1- (1,0) [-2147483648|2147483647] \"rad\"",
    );
    let layout = compile(&dbc, crate::common::CIA402);
    let error = Scales::new(&drives(DRIVES, 6), &layout).unwrap_err();
    assert!(error.to_string().contains("RPDO1_1.TargetPosition"));
    // A DBC file whose factors give SI units needs no gain.
    let dbc = cia402_dbc().replace("\"count\"", "\"rad\"").replace("\"per mille\"", "\"Nm\"");
    let text = rad.replace(TORQUE, "\"nm\"");
    let scales = Scales::new(&drives(&text, 6), &compile(&dbc, crate::common::CIA402)).unwrap();
    assert!(close(scales.position_rad(0, 1.5), 1.5) && close(scales.torque_nm(0, 1.5), 1.5));
}

#[test]
fn numbers_that_no_drive_has_are_refused() {
    for (from, to) in [
        ("counts_per_revolution = 8192", "counts_per_revolution = 0"),
        ("counts_per_revolution = 8192", "counts_per_revolution = -8192"),
        ("counts_per_revolution = 8192", "rad_per_count = nan"),
        ("rated_torque_nm = 2.0", "rated_torque_nm = 0.0"),
        ("rated_torque_nm = 2.0", "rated_torque_nm = inf"),
        ("zero = 0", "zero = inf"),
        ("zero = 0", "factor = -1.0, zero = 0"),
        ("rated_torque_nm = 2.0 } }", "rated_torque_nm = 2.0 } }, factor = 0.0"),
    ] {
        let text = DRIVES.replace(from, to);
        assert!(
            matches!(scales(&text), Err(UnitsError::Number { axis, .. }) if axis.position() == 0),
            "{to}"
        );
    }
    assert!(matches!(
        Scales::new(&drives(DRIVES, 5), &cia402()),
        Err(UnitsError::Drives { axes: 6, found: 5 })
    ));
}

#[test]
fn nothing_physical_has_a_default() {
    #[derive(Debug, serde::Deserialize)]
    struct Drives {
        #[allow(dead_code, reason = "only whether it is refused")]
        drives: Vec<DriveSpec>,
    }
    for (from, to) in [
        (", sign = 1", ""),
        ("sign = 1", "sign = 2"),
        (", zero = 0", ""),
        (", wraps = \"refuse\"", ""),
        (", provenance = \"test\"", ""),
        ("provenance = \"test\"", "provenance = \"  \""),
        ("rated_torque_nm", "rated_torque"),
        ("zero = 0", "zero = 0, offset = 1"),
    ] {
        let text = DRIVES.replace(from, to);
        assert_ne!(text, DRIVES);
        assert!(toml::from_str::<Drives>(&text).is_err(), "{to}");
    }
}

#[test]
fn half_a_range_from_the_middle_is_the_smallest_number() {
    let text = packed_drives().replace("wraps = \"refuse\"", "wraps = \"modulo\"");
    let layout = packed();
    let scales = Scales::new(&drives(&text, 6), &layout).unwrap();
    let half = f64::from(1_u32 << 31);
    for counts in [half, -half, 3.0 * half] {
        let mut values = CycleValues::default();
        values.axes[1].position = scales.position_value(1, counts * TAU / 8192.0);
        assert_eq!(values.axes[1].position.to_bits(), (-half).to_bits());
        layout.encode(Role::Sample, &values, 0, &mut Vec::new()).unwrap();
    }
}

proptest! {
    /// There and back, on an axis whose counter wraps within its travel.
    #[test]
    fn values_and_si_are_inverse(
        zero in any::<i32>(),
        travel in -1e9..1e9_f64,
        torque in -5.0..5.0_f64,
    ) {
        let text = packed_drives()
            .replace("wraps = \"refuse\"", "wraps = \"modulo\"")
            .replace("zero = 0", &format!("zero = {zero}"))
            .replace("sign = 1", "sign = -1");
        let scales = Scales::new(&drives(&text, 6), &packed()).unwrap();
        let angle = travel * TAU / 8192.0;
        let value = scales.position_value(2, angle);
        prop_assert!(value.abs() <= f64::from(1_u32 << 31));
        prop_assert!((scales.position_rad(2, value) - angle).abs() < 1e-6);
        let value = scales.reference_value(2, angle, 0.3);
        prop_assert!((scales.reference_rad(2, value, 0.3) - angle).abs() < 1e-6);
        prop_assert!(close(scales.torque_nm(2, scales.torque_value(2, torque)), torque));
    }
}
