//! What drives tell besides: temperatures, voltages, modes, following errors.

use std::fmt::Write as _;

use didim_drivers::assemble::Assembler;
use didim_drivers::frame::{Frame, FrameId};
use didim_drivers::layout::{
    AxisValues, CompiledLayout, CycleValues, LayoutError, LayoutSpec, Role, SampledBy,
};
use didim_drivers::units::{DriveSpec, Scales};
use didim_dynamics::{JointSample, Reading};

use crate::common::bus::{EPOCH_NS, check_sums, drives, feed};

const PERIOD_NS: u64 = 4_000_000;

/// A drive that tells everything by the SYNC but its temperature, voltage and mode.
const DBC: &str = r#"VERSION ""

NS_ :

BS_:

BU_: Drive

BO_ 128 SYNC: 0 Drive

BO_ 385 Fast: 8 Drive
 SG_ Position : 0|16@1- (1,0) [0|0] "count" Drive
 SG_ Torque : 16|16@1- (1,0) [0|0] "per mille" Drive
 SG_ Following : 32|16@1- (1,0) [0|0] "count" Drive

BO_ 641 Slow: 8 Drive
 SG_ Temperature : 0|16@1- (1,0) [-400|1500] "0.1 degC" Drive
 SG_ Voltage : 16|32@1+ (1,0) [0|0] "mV" Drive
 SG_ Mode : 48|8@1- (1,0) [0|0] "" Drive
"#;

const READINGS: &str = r#"
temperature = { signal = "Slow.Temperature" }
supply_voltage = { signal = "Slow.Voltage" }
mode = { signal = "Slow.Mode" }
"#;

fn spec(sync: &str, more: &str) -> LayoutSpec {
    let text = format!(
        r#"
dbc = "drive.dbc"
axes = 1
rate_hz = 250.0
{sync}
position = {{ signal = "Fast.Position", valid = "instant" }}
torque = {{ signal = "Fast.Torque", valid = "instant" }}
{more}
"#
    );
    toml::from_str(&text).unwrap()
}

fn compile(sync: &str, more: &str) -> Result<CompiledLayout, LayoutError> {
    CompiledLayout::compile(DBC, &spec(sync, more))
}

fn layout(more: &str) -> CompiledLayout {
    compile("sync = \"SYNC\"", more).unwrap()
}

fn drive(wraps: &str) -> DriveSpec {
    let text = crate::common::bus::DRIVES.replace("refuse", wraps);
    drives(&text, 1).remove(0)
}

fn assembler(layout: &CompiledLayout) -> Assembler {
    Assembler::new(layout.clone(), Scales::new(&[drive("refuse")], layout).unwrap())
}

fn values(axis: AxisValues) -> CycleValues {
    let mut values = CycleValues::default();
    values.axes[0] = axis;
    values
}

/// A cycle's frames: the SYNC, the drive, and where it is given the slow message, 1 ms after the
/// SYNC.
fn cycle(layout: &CompiledLayout, k: u64, slow: Option<[f64; 3]>) -> Vec<Frame> {
    let mut frames = Vec::new();
    let stamp_ns = EPOCH_NS + k * PERIOD_NS;
    let [temperature, voltage, mode] = slow.unwrap_or_default();
    let readings = [temperature, voltage, mode, 0.0, 0.0, 0.0, 0.0];
    #[expect(clippy::cast_precision_loss, reason = "small counts")]
    let values = values(AxisValues { position: k as f64, readings, ..AxisValues::default() });
    layout.encode(Role::Sync, &values, stamp_ns, &mut frames).unwrap();
    layout.encode(Role::Sample, &values, stamp_ns + 100_000, &mut frames).unwrap();
    if slow.is_some() {
        layout.encode(Role::Reading, &values, stamp_ns + 1_000_000, &mut frames).unwrap();
    }
    frames
}

fn readings_of(sample: &JointSample) -> [Option<i16>; 3] {
    let readings = [Reading::Temperature, Reading::SupplyVoltage, Reading::Mode];
    readings.map(|reading| sample.readings.get(reading, 0))
}

#[test]
fn a_reading_is_of_the_cycle_that_it_came_in_and_costs_no_other() {
    let layout = layout(READINGS);
    let slow = |k: u64| (k % 5 == 2).then_some([31.4, 48.02, 8.0]);
    let frames: Vec<Frame> = (0..21).flat_map(|k| cycle(&layout, k, slow(k))).collect();
    let mut assembler = assembler(&layout);
    let samples = feed(&mut assembler, &frames);
    check_sums(&assembler);
    assert_eq!(samples.len(), 20);
    for sample in &samples {
        let expected =
            if sample.sequence % 5 == 2 { [Some(314), Some(480), Some(8)] } else { [None; 3] };
        assert_eq!(readings_of(sample), expected, "{}", sample.sequence);
    }
    // From the middle on the same cycles have the same: nothing is remembered.
    let first = frames.iter().position(|frame| frame.stamp_ns == EPOCH_NS + 7 * PERIOD_NS).unwrap();
    let mut again = self::assembler(&layout).starting_at(7);
    assert_eq!(feed(&mut again, &frames[first..]), samples[7..]);
    // A slow frame before the first SYNC is of no cycle.
    let mut late = self::assembler(&layout);
    let early = frames.iter().position(|frame| frame.id.number() == 641).unwrap();
    assert_eq!(readings_of(&feed(&mut late, &frames[early..])[0]), [None; 3]);
    assert_eq!(late.losses().frames.before_first_sync, 1);
}

#[test]
fn what_is_out_of_its_range_is_no_reading_and_costs_nothing() {
    let layout = layout(READINGS);
    let mut frames: Vec<Frame> =
        (0..4).flat_map(|k| cycle(&layout, k, Some([20.0, 24.0, -3.0]))).collect();
    for frame in frames.iter_mut().filter(|frame| frame.id.number() == 641) {
        frame.payload[..2].copy_from_slice(&i16::MAX.to_le_bytes());
    }
    let samples = feed(&mut assembler(&layout), &frames);
    assert_eq!(samples.len(), 3);
    assert!(samples.iter().all(|sample| readings_of(sample) == [None, Some(240), Some(-3)]));
}

#[test]
fn a_packed_frame_may_have_readings_next_to_it_and_in_it() {
    let packed = compile("", READINGS).unwrap();
    assert_eq!(packed.sampled_by(), SampledBy::Packed);
    let frames: Vec<Frame> =
        (0..6).flat_map(|k| cycle(&packed, k, (k == 2).then_some([50.0, 1.0, 1.0]))).collect();
    let mut assembler = self::assembler(&packed);
    let samples = feed(&mut assembler, &frames);
    check_sums(&assembler);
    // What comes after a packed frame is of the next one, which is decided first.
    let temperatures: Vec<_> = samples.iter().map(|sample| readings_of(sample)[0]).collect();
    assert_eq!(temperatures, [None, None, None, Some(500), None, None]);
    let within = compile("", "mode = { signal = \"Fast.Following\" }").unwrap();
    let frames: Vec<Frame> =
        (0..3).flat_map(|k| cycle(&within, k, Some([0.0, 0.0, 5.0]))).collect();
    let samples = feed(&mut self::assembler(&within), &frames);
    assert!(samples.len() == 3 && samples.iter().all(|sample| readings_of(sample)[2] == Some(5)));
}

#[test]
fn a_following_error_makes_the_reference_of_either_sign() {
    for (which, sign) in [("target-minus-actual", 1.0), ("actual-minus-target", -1.0)] {
        let more = format!(
            "reference = {{ signal = \"Fast.Following\", valid = \"instant\", following_error = \
            \"{which}\" }}"
        );
        let layout = layout(&more);
        assert!(layout.has_reference());
        let mut frames = Vec::new();
        for k in 0..5_u64 {
            let stamp_ns = EPOCH_NS + k * PERIOD_NS;
            let axis =
                AxisValues { position: 30_000.0, reference: 12.0 * sign, ..Default::default() };
            for role in [Role::Sync, Role::Sample, Role::Target] {
                layout.encode(role, &values(axis), stamp_ns, &mut frames).unwrap();
            }
        }
        // A counter of 16 bits near its end, where the sum of both would be beyond it.
        for wraps in ["refuse", "modulo"] {
            let scales = Scales::new(&[drive(wraps)], &layout).unwrap();
            let samples = feed(&mut Assembler::new(layout.clone(), scales.clone()), &frames);
            assert_eq!(samples.len(), 4);
            for sample in &samples {
                let counts = 8192.0 / std::f64::consts::TAU;
                let (position, reference) =
                    (sample.motor_position_rad[0], sample.motor_reference_rad[0]);
                assert!(sample.has_reference);
                assert!((position * counts - 30_000.0).abs() < 1e-6);
                assert!((reference * counts - 30_012.0).abs() < 1e-6, "{which} {wraps}");
                let value = scales.reference_value(0, reference, position);
                assert!((value - 12.0 * sign).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn a_pipers_log_shows_its_temperatures_40_times_a_second() {
    let samples = crate::can_arms::samples_of("piper", "piper_1s.log");
    let mut counts = vec![0; 6];
    for sample in &samples {
        for (axis, found) in counts.iter_mut().enumerate() {
            if let Some(steps) = sample.readings.get(Reading::Temperature, axis) {
                let expected = 360 + 10 * i16::try_from(axis).unwrap();
                assert_eq!(steps, expected);
                assert_eq!(sample.readings.get(Reading::SupplyVoltage, axis), Some(241));
                *found += 1;
            }
        }
    }
    assert_eq!(counts, [39; 6]);
}

#[test]
fn every_answer_of_a_damiao_motor_shows_its_temperature() {
    let samples = crate::can_arms::samples_of("openarm", "openarm_half_second.log");
    assert_eq!(samples.len(), 248);
    for sample in &samples {
        let temperature = |axis| sample.readings.get(Reading::Temperature, axis).unwrap();
        assert!((0..7).all(|axis| (300..500).contains(&temperature(axis))), "{sample:?}");
    }
}

#[test]
fn what_cannot_be_a_reading_is_refused_in_words() {
    fn refused(sync: &str, more: &str, parts: &[&str]) {
        let error = compile(sync, more).unwrap_err().to_string();
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    }
    let sync = "sync = \"SYNC\"";
    let temperature = |signal| format!("temperature = {{ signal = \"{signal}\" }}");
    refused(sync, &temperature("Fast.Position"), &["a temperature in \"count\"", "\"degC\""]);
    refused(sync, "mode = { signal = \"Slow.Voltage\" }", &["integer of at most 16 bits"]);
    refused(sync, "supply_voltage = {}", &["`supply_voltage.signal`", "missing"]);
    refused(sync, "mode = { object = \"6061:00\" }", &["`mode.object`", "`nodes` and `slaves`"]);
    let following = "reference = { signal = \"Fast.Following\", valid = \"next-sync\", \
                     following_error = \"target-minus-actual\" }";
    refused(sync, following, &["`reference.valid`", "following error"]);
    let law = "law = { stiffness = \"Fast.Position\", damping = \"Slow.Voltage\", \
               speed = \"Slow.Voltage\", torque = \"Fast.Torque\" }";
    refused(sync, law, &["`law`", "needs `reference`"]);
    let reference_key = "reference = { signal = \"Fast.Following\", valid = \"instant\" }";
    refused(sync, &format!("{reference_key}\n{law}"), &["a stiffness in \"count\"", "\"Nm/rad\""]);
}

/// An edit of the shipped device file: an object of readings, in a PDO of its own that goes by
/// events.
fn with_events(eds: &str) -> String {
    let mut eds = eds.to_owned();
    let mut section = |name: &str, kind: &str, value: &str| {
        let _ = write!(
            eds,
            "\n[{name}]\nParameterName=x\nObjectType=0x7\nDataType={kind}\nAccessType=rw\n\
             DefaultValue={value}\nPDOMapping=0\n"
        );
    };
    section("2063", "0x0003", "0");
    section("1801sub1", "0x0007", "$NODEID+0x280");
    section("1801sub2", "0x0005", "255");
    section("1A01sub0", "0x0005", "1");
    section("1A01sub1", "0x0007", "0x20630010");
    for (index, subs) in [("1801", 3), ("1A01", 2)] {
        let _ = write!(eds, "\n[{index}]\nParameterName=x\nObjectType=0x9\nSubNumber={subs}\n");
    }
    eds
}

#[test]
fn an_object_that_goes_by_events_may_be_a_reading_and_no_position() {
    let eds = with_events(include_str!("../../config/eds/cia402_drive.eds"));
    let text = r#"
axes = 1
rate_hz = 250.0
nodes = [{ node_id = 1, eds = "drive.eds" }]
position = { object = "6064:00", unit = "count", valid = "instant" }
torque = { object = "6074:00", unit = "per mille", valid = "instant" }
temperature = { object = "2063:00", unit = "0.1 degC" }
"#;
    let compile =
        |text: &str| CompiledLayout::compile_nodes(&[&eds], &toml::from_str(text).unwrap());
    let layout = compile(text).unwrap();
    let slow = layout.messages().iter().find(|message| message.role == Role::Reading).unwrap();
    assert_eq!(slow.format.id, FrameId::standard(0x281).unwrap());
    assert_eq!(slow.extractions[0].signal.unit, "degC");
    let error = compile(&text.replace("6064:00", "2063:00")).unwrap_err().to_string();
    assert!(error.contains("type 255 does not go by the SYNC"), "{error}");
    let error = compile(&text.replace("0.1 degC", "kelvin")).unwrap_err().to_string();
    assert!(error.contains("a temperature in \"kelvin\""), "{error}");
    let law = format!(
        "{text}law = {{ stiffness = \"a.b\", damping = \"a.b\", speed = \"a.b\", torque = \"a.b\" \
        }}"
    );
    let error = compile(&law).unwrap_err().to_string();
    assert!(error.contains("`law`") && error.contains("DBC file"), "{error}");
    let moded =
        text.replace("temperature = { object = \"2063:00\"", "mode = { object = \"6061:00\"");
    let error = compile(&moded).unwrap_err().to_string();
    assert!(error.contains("`mode.unit`"), "{error}");
}
