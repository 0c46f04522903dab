//! The layout against an independent reader of DBC files, and against its own encoder.

#![allow(clippy::float_cmp, clippy::cast_possible_truncation, reason = "what is compared is exact")]

use crate::common::{cia402, cia402_dbc, packed, packed_dbc};
use didim_drivers::frame::{Frame, FrameId, FrameKind};
use didim_drivers::layout::{
    CompiledLayout, CycleValues, Database, LayoutError, LayoutSpec, Quantity, Role, SampledBy,
    Unreadable,
};
use proptest::prelude::*;

const ODD: &str = include_str!("golden/odd.dbc");
const GOLDEN: &str = include_str!("golden/layout.csv");

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len() / 2).map(|k| u8::from_str_radix(&hex[2 * k..2 * k + 2], 16).unwrap()).collect()
}

#[test]
fn every_signal_reads_as_cantools_reads_it() {
    let databases = [("cia402", cia402_dbc()), ("packed", packed_dbc()), ("odd", ODD)]
        .map(|(name, text)| (name, Database::parse(text).unwrap()));
    let mut lines = 0;
    for line in GOLDEN.lines() {
        let [dbc, message, payload, signal, value]: [&str; 5] =
            line.split(',').collect::<Vec<_>>().try_into().unwrap();
        let database = &databases.iter().find(|(name, _)| *name == dbc).unwrap().1;
        let read = database.signal("test", message, signal).unwrap().field.value(&bytes(payload));
        if value == "nan" {
            assert!(read.is_nan(), "{line}: {read}");
        } else {
            let expected = f64::from_bits(u64::from_str_radix(value, 16).unwrap());
            assert!(read == expected, "{line}: {read} is not {expected}");
        }
        lines += 1;
    }
    assert!(lines > 900, "{lines}");
}

#[test]
fn inserting_what_was_read_gives_the_payload_back() {
    // Every bit of an Intel and of a Motorola message that is no signal stays as it was.
    let database = Database::parse(ODD).unwrap();
    for line in GOLDEN.lines().filter(|line| line.starts_with("odd,") && !line.contains("Wide")) {
        let columns: Vec<&str> = line.split(',').collect();
        let payload = bytes(columns[2]);
        let field = database.signal("test", columns[1], columns[3]).unwrap().field;
        let mut copy = payload.clone();
        field.write_bits(&mut copy, !field.bits(&payload));
        assert_ne!(copy, payload);
        field.write_bits(&mut copy, field.bits_for(field.value(&payload)).unwrap());
        assert_eq!(copy, payload, "{line}");
    }
}

/// One reply identifier for all drives: the multiplexer says whose values a frame has.
#[test]
fn multiplexed_signals_are_messages_of_their_own() {
    let dbc = "VERSION \"\"\nNS_ :\nBS_:\nBU_: Drive Controller\nBO_ 128 SYNC: 0 Controller\n\
        BO_ 385 State: 8 Drive\n SG_ Axis M : 0|8@1+ (1,0) [0|6] \"\" Controller\n \
        SG_ Pos_1 m1 : 8|32@1- (1,0) [0|0] \"count\" Controller\n \
        SG_ Trq_1 m1 : 40|16@1- (1,0) [0|0] \"\" Controller\n \
        SG_ Pos_2 m2 : 8|32@1- (1,0) [0|0] \"count\" Controller\n \
        SG_ Trq_2 m2 : 40|16@1- (1,0) [0|0] \"\" Controller\n";
    let spec = "axes = 2\nrate_hz = 500.0\nsync = \"SYNC\"\n\
        position = { signal = \"State.Pos_{axis}\", valid = \"instant\" }\n\
        torque = { signal = \"State.Trq_{axis}\", valid = \"instant\" }\n";
    let spec: LayoutSpec = toml::from_str(spec).unwrap();
    let layout = CompiledLayout::compile(dbc, &spec).unwrap();
    let mut values = CycleValues::default();
    for (axis, (position, torque)) in [(7.0, -1.0), (-9.0, 3.0)].into_iter().enumerate() {
        (values.axes[axis].position, values.axes[axis].torque) = (position, torque);
    }
    let mut frames = Vec::new();
    layout.encode(Role::Sample, &values, 0, &mut frames).unwrap();
    assert_eq!(frames.len(), 2);
    assert_eq!(frames[1].data(), [2, 0xF7, 0xFF, 0xFF, 0xFF, 3, 0, 0]);
    for (axis, frame) in frames.iter().enumerate() {
        let (index, message) = layout.read(frame).unwrap();
        assert_eq!(layout.messages()[index], *message);
        for extraction in &message.extractions {
            assert_eq!(extraction.axis, axis);
            let expected = match extraction.quantity {
                Quantity::Position => values.axes[axis].position,
                _ => values.axes[axis].torque,
            };
            assert_eq!(extraction.value(frame.data()), Some(expected));
        }
    }
    let other = Frame::classic(FrameId::Standard(385), &[3, 0, 0, 0, 0, 0, 0, 0]).unwrap();
    assert_eq!(layout.read(&other).unwrap_err(), Unreadable::Excepted);
}

#[test]
fn the_shipped_layouts_say_what_they_are() {
    let drives = cia402();
    assert_eq!(drives.sampled_by(), SampledBy::Sync);
    assert_eq!(drives.messages().len(), 13);
    assert!((drives.period_ns() - 4e6).abs() < 1e-9);
    assert!((drives.torque_timing().hold_s - 4e-3).abs() < 1e-15);
    assert!(drives.reference_at_next_sync());
    assert_eq!(drives.signal(Quantity::Position, 5).unwrap().unit, "count");
    assert_eq!(drives.signal(Quantity::Torque, 0).unwrap().unit, "per mille");
    let roles = |role| drives.messages().iter().filter(|m| m.role == role).count();
    assert_eq!([roles(Role::Sync), roles(Role::Sample), roles(Role::Target)], [1, 6, 6]);

    let layout = packed();
    assert_eq!(layout.sampled_by(), SampledBy::Packed);
    assert_eq!(layout.messages().len(), 1);
    assert!(layout.messages()[0].format.is_fd);
    assert_eq!(layout.messages()[0].format.length, 64);
}

/// Values of six axes that both shipped layouts can carry.
fn cycle() -> impl Strategy<Value = CycleValues> {
    let axis = (any::<i32>(), any::<i16>(), any::<i32>(), any::<u16>());
    (proptest::collection::vec(axis, 6), any::<u32>()).prop_map(|(axes, counter)| {
        let mut values = CycleValues { counter: counter.into(), ..CycleValues::default() };
        for (axis, (position, torque, reference, status_word)) in values.axes.iter_mut().zip(axes) {
            axis.position = position.into();
            axis.torque = torque.into();
            axis.reference = reference.into();
            axis.status_word = status_word;
        }
        values
    })
}

/// What the frames of one cycle say, as the encoder's argument.
fn decode(layout: &CompiledLayout, frames: &[Frame]) -> CycleValues {
    let mut values = CycleValues::default();
    for frame in frames {
        let (_, message) = layout.read(frame).unwrap();
        for e in &message.extractions {
            let value = e.value(frame.data()).unwrap();
            let axis = &mut values.axes[e.axis];
            match e.quantity {
                Quantity::Position => axis.position = value,
                Quantity::Torque => axis.torque = value,
                Quantity::Reference => axis.reference = value,
                Quantity::StatusWord | Quantity::Enabled => axis.status_word = value as u16,
                Quantity::Counter => values.counter = value as u64,
                Quantity::NetworkState | Quantity::Reading(_) => {}
            }
        }
    }
    values
}

fn encode(layout: &CompiledLayout, values: &CycleValues) -> Vec<Frame> {
    let mut frames = Vec::new();
    for role in [Role::Sync, Role::Sample, Role::Target] {
        layout.encode(role, values, 7, &mut frames).unwrap();
    }
    frames
}

proptest! {
    #[test]
    fn decoding_undoes_encoding(values in cycle()) {
        let mut expected = values;
        expected.counter = 0;
        let drives = cia402();
        prop_assert_eq!(decode(&drives, &encode(&drives, &values)), expected);

        let layout = packed();
        let mut expected = values;
        expected.axes.iter_mut().for_each(|axis| axis.status_word = 0);
        prop_assert_eq!(decode(&layout, &encode(&layout, &values)), expected);
    }
}

fn odd_spec() -> LayoutSpec {
    let spec = r#"
dbc = "odd.dbc"
axes = 1
rate_hz = 100
position = { signal = "Intel.Twelve", valid = "instant" }
torque = { signal = "Intel.Rest", valid = "instant" }
"#;
    toml::from_str(spec).unwrap()
}

#[test]
fn the_file_that_is_damaged_below_is_good() {
    assert!(CompiledLayout::compile(ODD, &odd_spec()).is_ok());
}

proptest! {
    /// Bytes of a DBC file cut out, doubled or replaced: it is read or refused.
    #[test]
    fn a_damaged_file_does_not_panic(
        cuts in proptest::collection::vec((0..1_400_usize, 0..4_usize, "[ -~\n]{0,3}"), 1..6),
    ) {
        let mut text = ODD.to_owned();
        for (at, length, new) in cuts {
            let place = at.min(text.len());
            let end = (place + length).min(text.len());
            text.replace_range(place..end, &new);
        }
        if let Ok(layout) = CompiledLayout::compile(&text, &odd_spec()) {
            // Whatever it has become, its bits lie in its message, and there are two of them.
            let extractions: Vec<_> =
                layout.messages().iter().flat_map(|m| &m.extractions).collect();
            prop_assert_eq!(extractions.len(), 2);
            for extraction in extractions {
                let width = extraction.signal.field.width();
                let bits = extraction.signal.field.bits(&[0xFF; 8]);
                prop_assert_eq!(bits, u64::MAX >> (64 - width));
                let _ = extraction.value(&[0xFF; 64]);
            }
        }
        if let Ok(database) = Database::parse(&text) {
            let signals = [("Motorola", "Crossing"), ("Intel", "Rest"), ("Wide", "Last")];
            for (message, signal) in signals {
                if let Ok(signal) = database.signal("test", message, signal) {
                    let bits = signal.field.bits(&[0xFF; 64]);
                    prop_assert_eq!(bits, u64::MAX >> (64 - signal.field.width()));
                }
            }
        }
    }
}

#[test]
fn a_value_that_does_not_fit_is_refused_and_nothing_is_encoded() {
    let layout = cia402();
    for torque in [32_767.6, -32_769.0, f64::NAN, f64::INFINITY] {
        let mut values = CycleValues::default();
        values.axes[3].torque = torque;
        let mut frames = Vec::new();
        let error = layout.encode(Role::Sample, &values, 0, &mut frames).unwrap_err();
        assert_eq!(error.signal, "TPDO1_4.TorqueDemand");
        assert!(frames.is_empty());
    }
}

#[test]
fn a_frame_that_is_none_of_the_layouts_says_why() {
    let layout = cia402();
    let mut frames = Vec::new();
    layout.encode(Role::Sample, &CycleValues::default(), 0, &mut frames).unwrap();
    let good = frames[0];
    assert_eq!(good.id, FrameId::Standard(0x181));
    assert!(layout.read(&good).is_ok());
    let fd = FrameKind::Fd { bit_rate_switch: false, error_state_indicator: false };
    for (frame, why) in [
        (Frame { kind: FrameKind::Error, ..good }, Unreadable::Error),
        (Frame { kind: FrameKind::Remote, ..good }, Unreadable::Remote),
        (Frame { id: FrameId::Standard(0x7FF), ..good }, Unreadable::UnknownId),
        (Frame { id: FrameId::Standard(0xFFFF), ..good }, Unreadable::UnknownId),
        (Frame { id: FrameId::Extended(0x181), ..good }, Unreadable::UnknownId),
        (Frame { kind: fd, ..good }, Unreadable::WrongFormat),
        (Frame { length: 7, ..good }, Unreadable::WrongLength),
    ] {
        assert_eq!(layout.read(&frame).unwrap_err(), why);
    }
}

#[test]
fn floating_point_extended_identifiers_and_padding_are_read() {
    let dbc = r#"
BO_ 2566839348 Arm: 13 Device
 SG_ Angle : 7|32@0- (1,0) [0|0] "rad" Vector__XXX
 SG_ Torque : 32|64@1- (1,0) [-50|50] "Nm" Vector__XXX

SIG_VALTYPE_ 2566839348 Angle : 1;
SIG_VALTYPE_ 2566839348 Torque : 2;
"#;
    let spec = r#"
dbc = "arm.dbc"
axes = 1
rate_hz = 1000
position = { signal = "Arm.Angle", valid = "instant" }
torque = { signal = "Arm.Torque", valid = "instant" }
"#;
    let layout = crate::common::compile(dbc, spec);
    let mut values = CycleValues::default();
    values.axes[0].position = -0.75;
    values.axes[0].torque = 1e-3;
    let frame = encode(&layout, &values)[0];
    assert_eq!(frame.id, FrameId::Extended(2_566_839_348 - (1 << 31)));
    // 13 bytes are padded to the next length that CAN FD has.
    assert_eq!(frame.length, 16);
    assert_eq!(frame.data()[..4], (-0.75_f32).to_be_bytes());
    assert_eq!(decode(&layout, &[frame]), values);
    assert!(layout.read(&Frame { length: 13, ..frame }).is_ok());
    assert_eq!(layout.read(&Frame { length: 12, ..frame }), Err(Unreadable::WrongLength));

    let (_, message) = layout.read(&frame).unwrap();
    let mut payload = frame.payload;
    payload[..4].copy_from_slice(&f32::NAN.to_be_bytes());
    payload[4..12].copy_from_slice(&50.1_f64.to_le_bytes());
    assert_eq!(message.extractions[0].value(&payload), None);
    assert_eq!(message.extractions[1].value(&payload), None);
}

#[test]
fn signals_of_no_message_are_passed_over() {
    let independent = "BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX\n \
                       SG_ Spare : 0|8@1+ (1,0) [0|0] \"\" Vector__XXX\n\n";
    let dbc = cia402_dbc().replacen("BO_ ", &format!("{independent}BO_ "), 1);
    assert_ne!(dbc, cia402_dbc());
    assert_eq!(crate::common::compile(&dbc, crate::common::CIA402), cia402());
    // The identifier alone is none.
    let other = dbc.replace("VECTOR__INDEPENDENT_SIG_MSG", "Other");
    let refused = |text: &str| match refusal(text, crate::common::CIA402) {
        LayoutError::IdOutOfRange { message, id, .. } => (message, id),
        error => panic!("{error}"),
    };
    assert_eq!(refused(&other), ("Other".to_owned(), 0xC000_0000));
    let unmarked = cia402_dbc().replacen("BO_ 385 ", "BO_ 419365249 ", 1);
    assert_eq!(refused(&unmarked).1, 0x18FF_0181);
    let said = refusal(&unmarked, crate::common::CIA402).to_string();
    assert!(said.contains("2566848897"), "{said}");
}

#[test]
fn the_limits_of_a_range_are_in_it() {
    // 32767 × 0.1 is 3276.7000000000003.
    let dbc = cia402_dbc().replace(
        "SG_ TorqueDemand : 48|16@1- (1,0) [-32768|32767]",
        "SG_ TorqueDemand : 48|16@1- (0.1,0) [-3000.1|3276.7]",
    );
    assert_ne!(dbc, cia402_dbc());
    let layout = crate::common::compile(&dbc, crate::common::CIA402);
    let message = layout.messages().iter().find(|message| message.role == Role::Sample).unwrap();
    let torque = message.extractions.iter().find(|e| e.quantity == Quantity::Torque).unwrap();
    for (raw, inside) in [(32_767, true), (-30_001, true), (-30_002, false), (0, true)] {
        let mut payload = [0; 8];
        torque.signal.field.write_bits(&mut payload, i64::from(raw).cast_unsigned());
        assert_eq!(torque.value(&payload).is_some(), inside, "{raw}");
    }
}

fn refusal(dbc: &str, layout: &str) -> LayoutError {
    let spec: LayoutSpec = toml::from_str(layout).unwrap();
    CompiledLayout::compile(dbc, &spec).unwrap_err()
}

#[test]
fn what_does_not_fit_is_named() {
    let spec = crate::common::CIA402;
    let dbc = cia402_dbc();
    let cases = [
        (dbc.to_owned(), spec.replace("TorqueDemand", "TorqueDemanded"), "similar: `TorqueDemand`"),
        (
            dbc.to_owned(),
            spec.replace("TPDO1_", "TPDO2_"),
            "no message `TPDO2_1`; similar: `TPDO1_1`",
        ),
        (
            dbc.to_owned(),
            spec.replace("TPDO1_{axis}.P", "TPDO1_1.P"),
            "does a pattern lack `{axis}`",
        ),
        (dbc.to_owned(), spec.replace("axes = 6", "axes = 17"), "`axes`: 17"),
        (dbc.to_owned(), spec.replace("axes = 6", "axes = 7"), "no message `TPDO1_7`"),
        (dbc.to_owned(), spec.replace("rate_hz = 250.0", "rate_hz = 0.0"), "`rate_hz`: 0 Hz"),
        (dbc.to_owned(), spec.replace("rate_hz = 250.0", ""), "either `period_us` or `rate_hz`"),
        (dbc.to_owned(), spec.replace("hold_us = 4000.0", "hold_us = 4e6"), "ten periods"),
        (dbc.to_owned(), spec.replace("sync = \"SYNC\"", ""), "`sync`: missing"),
        (dbc.to_owned(), spec.replace(".StatusWord", ""), "a signal is named `Message.Signal`"),
        (
            dbc.to_owned(),
            format!("counter = \"TPDO1_1.StatusWord\"\n{spec}"),
            "`counter`: is for packed frames",
        ),
        (dbc.to_owned(), spec.replace(".StatusWord", ".TorqueDemand"), "unsigned integer"),
        (dbc.replace("BO_ 386 ", "BO_ 385 "), spec.to_owned(), "same identifier 385"),
        (
            dbc.replace("BO_ 386 ", "BO_ 65921 "),
            spec.to_owned(),
            "line 25 of the DBC file: the identifier 65921 of message `TPDO1_2`",
        ),
        (dbc.replace("TPDO1_2", "TPDO1_1"), spec.to_owned(), "two of the name `TPDO1_1`"),
        (
            dbc.replace("48|16@1- (1,0) [-", "49|16@1- (1,0) [-"),
            spec.to_owned(),
            "line 18 of the DBC",
        ),
        (
            dbc.replace("TorqueDemand : 48|16@1- (1,", "TorqueDemand : 48|16@1- (0,"),
            spec.to_owned(),
            "factor 0",
        ),
        (
            dbc.replace("PositionActualValue :", "PositionActualValue m0 :"),
            spec.to_owned(),
            "has no multiplexer (M)",
        ),
        (
            dbc.replace("PositionActualValue :", "PositionActualValue m0M :"),
            spec.to_owned(),
            "multiplexed itself",
        ),
        (
            dbc.replace("SG_ StatusWord : 0|16@1+", "SG_ StatusWord : 0|16@9+"),
            spec.to_owned(),
            "(line 16 of the DBC file)",
        ),
        (dbc.replace("TPDO1_1: 8", "TPDO1_1: 12"), spec.to_owned(), "VFrameFormat"),
        (format!("{dbc}SIG_VALTYPE_ 385 TorqueDemand : 1;\n"), spec.to_owned(), "32 to 32"),
    ];
    for (dbc, spec, expected) in cases {
        let message = refusal(&dbc, &spec).to_string();
        assert!(message.contains(expected), "`{message}` does not say `{expected}`");
    }
}

#[test]
fn a_layout_with_an_unknown_key_or_without_a_validity_is_refused() {
    for (from, to) in [
        ("axes = 6", "axes = 6\naxis = 6"),
        (", valid = \"instant\"", ""),
        ("delay_us = 0.0", "delay_us = 0.0, delay_s = 0.0"),
        ("\"next-sync\"", "\"next\""),
    ] {
        let text = crate::common::CIA402.replace(from, to);
        assert_ne!(text, crate::common::CIA402);
        assert!(toml::from_str::<LayoutSpec>(&text).is_err(), "{to}");
    }
}
