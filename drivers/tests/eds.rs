//! Layouts from device files: against the DBC file of the same drives, and with faults put in.

#![allow(clippy::float_cmp, clippy::print_stdout, reason = "what is compared is exact, and shown")]

use crate::common::cia402;
use didim_drivers::frame::FrameId;
use didim_drivers::layout::{
    AxisValues, CompiledLayout, CycleValues, Encoding, LayoutError, LayoutSpec,
    MAX_DEVICE_FILE_BYTES, Quantity, Role,
};
use proptest::prelude::*;

const EDS: &str = include_str!("../../config/eds/cia402_drive.eds");
const TORQUE: &str = "torque = { object = \"6074:00\", unit = \"per mille\", valid = { held = { \
    hold_us = 4000.0, delay_us = 0.0 } } }";

/// A layout of so many nodes, with one line replaced.
fn spec(axes: usize, kind: &str, from: &str, to: &str) -> LayoutSpec {
    let nodes: Vec<String> = (1..=axes)
        .map(|node| format!("{{ node_id = {node}, {kind} = \"drive.{kind}\" }}"))
        .collect();
    let text = format!(
        r#"
axes = {axes}
rate_hz = 250.0
nodes = [{}]
position = {{ object = "6064:00", unit = "count", valid = "instant" }}
{TORQUE}
reference = {{ object = "607A:00", unit = "count", valid = "next-sync" }}
status_word = "6041:00"
"#,
        nodes.join(", ")
    );
    assert!(text.contains(from), "{from}");
    toml::from_str(&text.replace(from, to)).unwrap()
}

fn plain(axes: usize) -> LayoutSpec {
    spec(axes, "eds", "axes", "axes")
}

fn six() -> CompiledLayout {
    CompiledLayout::compile_nodes(&[EDS; 6], &plain(6)).unwrap()
}

/// One node whose device file has an edit.
fn edited(from: &str, to: &str) -> Result<CompiledLayout, LayoutError> {
    assert!(EDS.contains(from), "{from:?}");
    CompiledLayout::compile_nodes(&[&EDS.replacen(from, to, 1)], &plain(1))
}

#[track_caller]
fn refused(result: Result<CompiledLayout, LayoutError>, says: &[&str]) {
    let message = result.unwrap_err().to_string();
    println!("{message}");
    for part in says {
        assert!(message.contains(part), "should say {part:?}: {message}");
    }
}

#[test]
fn the_plan_has_the_frames_of_the_dbc_file() {
    let (own, dbc) = (six(), cia402());
    assert_eq!(own.messages().len(), dbc.messages().len());
    for (own, dbc) in own.messages().iter().zip(dbc.messages()) {
        assert_eq!((own.format.id, own.format.is_fd), (dbc.format.id, dbc.format.is_fd));
        assert_eq!((own.format.length, own.role), (dbc.format.length, dbc.role));
        let fields = |plan: &didim_drivers::layout::MessagePlan| {
            plan.extractions
                .iter()
                .map(|e| (e.quantity, e.axis, e.signal.field, e.signal.unit.clone()))
                .collect::<Vec<_>>()
        };
        assert_eq!(fields(own), fields(dbc));
    }
    assert_eq!(own.sampled_by(), dbc.sampled_by());
    assert_eq!(own.torque_timing(), dbc.torque_timing());
    assert_eq!(own.reference_at_next_sync(), dbc.reference_at_next_sync());
}

proptest! {
    /// Whatever the drives send, both plans read the same numbers.
    #[test]
    fn both_plans_read_the_same_values(
        values in prop::array::uniform6((any::<i32>(), any::<i16>(), any::<i32>(), any::<u16>()))
    ) {
        let (own, dbc) = (six(), cia402());
        let mut cycle = CycleValues::default();
        for (axis, values) in cycle.axes.iter_mut().zip(values) {
            let (position, torque, reference, status_word) = values;
            *axis = AxisValues {
                position: position.into(),
                torque: torque.into(),
                reference: reference.into(),
                status_word,
                ..AxisValues::default()
            };
        }
        let mut frames = Vec::new();
        for role in [Role::Sync, Role::Sample, Role::Target] {
            dbc.encode(role, &cycle, 7, &mut frames).unwrap();
        }
        prop_assert_eq!(frames.len(), 13);
        for frame in &frames {
            let ((_, a), (_, b)) = (own.read(frame).unwrap(), dbc.read(frame).unwrap());
            for (a, b) in a.extractions.iter().zip(&b.extractions) {
                prop_assert_eq!(a.value(&frame.payload), b.value(&frame.payload));
            }
        }
    }

    /// A device file with anything in place of anything: refused or compiled, never a panic.
    #[test]
    fn damaged_files_do_no_harm(
        cuts in prop::collection::vec(
            (0..EDS.len(), 0usize..40, "[\\PC\\n=\\[\\]x0-9]{0,12}"),
            1..6,
        )
    ) {
        let mut bytes = EDS.as_bytes().to_vec();
        for (at, length, text) in cuts {
            let place = at.min(bytes.len());
            let end = (place + length).min(bytes.len());
            bytes.splice(place..end, text.bytes());
        }
        let text = String::from_utf8_lossy(&bytes);
        let _ = CompiledLayout::compile_nodes(&[&text], &plain(1));
    }

    #[test]
    fn any_text_does_no_harm(text in "\\PC{0,200}") {
        let _ = CompiledLayout::compile_nodes(&[&text], &plain(1));
    }

    /// Any mapping words and lengths.
    #[test]
    fn any_mapping_does_no_harm(
        count in any::<u8>(),
        words in prop::array::uniform3(any::<u32>()),
    ) {
        let mut text = EDS.replace("DefaultValue=0x03", &format!("DefaultValue={count}"));
        for (word, old) in words.into_iter().zip(["0x60410010", "0x60640020", "0x60740010"]) {
            text = text.replace(old, &format!("{word}"));
        }
        let _ = CompiledLayout::compile_nodes(&[&text], &plain(1));
    }
}

/// Gaps of dummy entries, fields below a byte, and types of other widths.
#[test]
fn fields_lie_where_the_mapping_puts_them() {
    let text = EDS
        .replace(
            "[1A00sub0]\nParameterName=Number of mapped \
            objects\nObjectType=0x7\nDataType=0x0005\nAccessType=rw\nDefaultValue=0x03",
            "[1A00sub0]\nParameterName=n\nDefaultValue=5",
        )
        .replace("0x60410010", "0x20000001")
        .replace("0x60640020", "0x00050008")
        .replace("0x60740010", "0x60410010");
    let text = format!(
        "{text}\n[1A00sub4]\nDefaultValue=0x60640018\n[1A00sub5]\nDefaultValue=0x60740008\n\
         [2000]\nObjectType=7\nDataType=1\n"
    );
    let position = "[6064]\nParameterName=Position actual value\nObjectType=0x7\nDataType=0x0004";
    let torque = "[6074]\nParameterName=Torque demand\nObjectType=0x7\nDataType=0x0003";
    assert!(text.contains(position) && text.contains(torque));
    let text =
        text.replace(position, "[6064]\nDataType=0x10").replace(torque, "[6074]\nDataType=0x0002");
    let layout = CompiledLayout::compile_nodes(&[&text], &plain(1)).unwrap();
    let (position, torque) = (
        layout.signal(Quantity::Position, 0).unwrap(),
        layout.signal(Quantity::Torque, 0).unwrap(),
    );
    assert_eq!((position.field.width(), position.field.encoding()), (24, Encoding::Signed));
    assert_eq!((torque.field.width(), torque.field.encoding()), (8, Encoding::Signed));
    // One bit, eight bits of nothing, 16 of the status word, then 24 and 8: 57 bits in 8 bytes.
    let plan = layout.messages().iter().find(|m| m.role == Role::Sample).unwrap();
    assert_eq!((plan.format.length, plan.format.id), (8, FrameId::Standard(0x181)));
    // By hand: the numbers shifted to their bits.
    let word: u64 = 1 | 0x0637 << 9 | (0x00FF_FFFE & 0xFF_FFFF) << 25 | 0x80 << 49;
    assert_eq!(position.field.value(&word.to_le_bytes()), -2.0);
    assert_eq!(torque.field.value(&word.to_le_bytes()), -128.0);
    assert_eq!(
        layout.signal(Quantity::StatusWord, 0).unwrap().field.value(&word.to_le_bytes()),
        1591.0
    );
}

/// What was configured counts in a DCF, and in a DCF only.
#[test]
fn a_dcf_says_what_was_configured() {
    let text = EDS
        .replace("DefaultValue=$NODEID+0x180", "DefaultValue=$NODEID+0x180\nParameterValue=0x2A1")
        .replace("[Comments]", "[DeviceComissioning]\nNodeID=1\n\n[Comments]");
    fn id(kind: &str, text: &str) -> FrameId {
        let spec = spec(1, kind, "axes", "axes");
        let layout = CompiledLayout::compile_nodes(&[text], &spec).unwrap();
        layout.messages().iter().find(|m| m.role == Role::Sample).unwrap().format.id
    }
    assert_eq!(id("dcf", &text), FrameId::Standard(0x2A1));
    assert_eq!(id("eds", &text), FrameId::Standard(0x181));
    let other = text.replace("NodeID=1\n", "NodeID=9\n");
    let spec = spec(1, "dcf", "axes", "axes");
    refused(CompiledLayout::compile_nodes(&[&other], &spec), &["drive.dcf", "NodeID", "node 9"]);
}

/// A mapping in the compact form of CiA 306.
#[test]
fn compact_sub_objects_are_read() {
    let start = EDS.find("[1A00]").unwrap();
    let end = EDS.find("[6040]").unwrap();
    let compact = "[1A00]\nParameterName=map\nObjectType=9\nDataType=7\nCompactSubObj=3\n\n\
                   [1A00Value]\nNrOfEntries=3\n1=0x60410010\n2=0x60640020\n3=0x60740010\n\n";
    let text = format!("{}{compact}{}", &EDS[..start], &EDS[end..]);
    let layout = CompiledLayout::compile_nodes(&[&*text; 6], &plain(6)).unwrap();
    assert_eq!(layout, six());
}

/// Axes of one drive: their objects lie 800h apart and their PDOs under one node.
#[test]
fn a_node_may_have_several_axes() {
    let second =
        EDS[EDS.find("[6040]").unwrap()..].replace("\n[60", "\n[68").replace("[6040", "[6840");
    let pdos = EDS[EDS.find("[1400]").unwrap()..EDS.find("[6040]").unwrap()]
        .replace("[14", "[14X")
        .replace("[14X00", "[1401")
        .replace("[1600", "[1601")
        .replace("[1800", "[1801")
        .replace("[1A00", "[1A01")
        .replace("+0x180", "+0x280")
        .replace("+0x200", "+0x300")
        .replace("=0x60", "=0x68");
    let second = second.replace("\n[6502]", "\n[6D02]");
    let text = format!("{EDS}\n{pdos}\n{second}");
    let spec = spec(2, "eds", "node_id = 2, ", "node_id = 1, object_offset = 0x800, ");
    let layout = CompiledLayout::compile_nodes(&[&text, &text], &spec).unwrap();
    let ids: Vec<u32> = layout.messages().iter().map(|m| m.format.id.number()).collect();
    assert_eq!(ids, [0x080, 0x181, 0x201, 0x281, 0x301]);
    assert!(layout.signal(Quantity::Torque, 1).unwrap().name.contains("6874:00"));
}

#[test]
fn a_sync_with_a_counter_has_one_byte() {
    let layout = edited("[1400]", "[1019]\nDataType=5\nDefaultValue=10\n\n[1400]").unwrap();
    let sync = layout.messages().iter().find(|m| m.role == Role::Sync).unwrap();
    assert_eq!(sync.format.length, 1);
    assert!(!sync.format.is_fd && layout.messages().iter().all(|m| !m.format.is_fd));
}

#[test]
fn what_cannot_be_used_is_refused_with_its_place() {
    let transmission = "[1800sub2]\nParameterName=Transmission \
        type\nObjectType=0x7\nDataType=0x0005\nAccessType=rw\nDefaultValue=1\n";
    let transmission_with =
        |kind: &str| transmission.replace("Value=1\n", &format!("Value={kind}\n"));
    for (kind, says) in [
        ("254", "does not go by the SYNC"),
        ("255", "does not go by the SYNC"),
        ("252", "does not go by the SYNC"),
        ("0", "only when a value has changed"),
        ("4", "every 4th SYNC"),
    ] {
        let result = edited(transmission, &transmission_with(kind));
        refused(result, &["drive.eds: line ", "[1800sub2] DefaultValue", says, "set it to 1"]);
    }
    let cob_id = "DefaultValue=$NODEID+0x180";
    refused(edited(cob_id, "DefaultValue=$NODEID+0x80000180"), &["1800sub1", "bit 31", "TPDO1"]);
    refused(edited(cob_id, "DefaultValue=0x1800"), &["1800sub1", "11 bits"]);
    refused(edited(cob_id, "DefaultValue="), &["[1800sub1] has no DefaultValue", "DCF"]);
    refused(edited(cob_id, "DefaultValue=0180"), &["`0180` is not a number"]);
    refused(edited(cob_id, "DefaultValue=0x80"), &["TPDO1 of node 1", "that of SYNC"]);
    refused(edited("0x60640020", "0x60630020"), &["`position.object`", "6064:00", "6063:00"]);
    refused(edited("0x60640020", "0x60640010"), &["6064:00", "16 bits", "has 32"]);
    refused(edited("0x60640020", "0x60640040"), &["1A00sub2", "at most 64"]);
    refused(edited("0x60640020", "0x60640000"), &["1A00sub2", "at least one"]);
    refused(edited("DefaultValue=0x00000080\nPDOMapping=0\n", ""), &["[1005sub0] has no"]);
    let text = edited("Dummy0001=0", "Dummy0001");
    refused(text, &["drive.eds: line", "key=value"]);
    refused(edited("[1001]", "[1000]"), &["[1000] is there already", "remove"]);
    refused(edited("[1001]", "[1001"), &["[name]"]);
    let long = edited("[1001]", &format!("; {}\n[1001]", "x".repeat(MAX_DEVICE_FILE_BYTES)));
    refused(long, &["drive.eds", "longer than 8388608 bytes"]);
    let position = "[6064]\nParameterName=Position actual value\nObjectType=0x7\nDataType=0x0004";
    refused(edited(position, "[6064]\nDataType=0x0009"), &["[6064] DataType", "0x0009"]);
    refused(edited(position, "[6099]\nDataType=0x0004"), &["[6064sub0] has no DataType"]);
    // One identifier for all nodes.
    let same = EDS.replace("$NODEID+0x180", "0x181");
    let result = CompiledLayout::compile_nodes(&[&same, &same], &plain(2));
    refused(result, &["TPDO1 of node 2", "that of TPDO1 of node 1", "$NODEID"]);
    // Two SYNCs.
    let other = EDS.replacen("DefaultValue=0x00000080", "DefaultValue=0x81", 1);
    refused(CompiledLayout::compile_nodes(&[EDS, &other], &plain(2)), &["1005", "alike"]);
}

#[test]
fn keys_that_do_not_go_together_are_refused() {
    let compile =
        |from: &str, to: &str| CompiledLayout::compile_nodes(&[EDS], &spec(1, "eds", from, to));
    refused(compile("rate_hz", "sync = \"SYNC\"\nrate_hz"), &["`sync`", "1005h"]);
    refused(compile("rate_hz", "counter = \"x\"\nrate_hz"), &["`counter`"]);
    refused(compile("object = \"6064:00\", ", ""), &["`position.object`", "missing"]);
    refused(
        compile("object = \"6064:00\"", "object = \"6064\""),
        &["`position.object`", "6064:00"],
    );
    refused(compile("object = \"6064:00\"", "signal = \"A.B\""), &["`position.signal`"]);
    refused(
        compile("unit = \"count\", valid = \"instant\"", "valid = \"instant\""),
        &["`position.unit`", "manual"],
    );
    refused(compile("node_id = 1", "node_id = 128"), &["node_id 128"]);
    refused(compile("eds = \"drive.eds\"", "object_offset = 0"), &["either `eds` or `dcf`"]);
    refused(compile("axes = 1", "axes = 2"), &["`nodes`", "1 for 2 axes"]);
    // Applied at the SYNC after it was received, not at the one whose cycle carries it.
    let instant = compile("\"next-sync\"", "\"instant\"");
    refused(instant, &["`reference.object`", "no TPDO", "607A:00"]);
    let dbc = spec(1, "eds", "axes", "axes");
    refused(CompiledLayout::compile("", &dbc), &["`nodes`", "not both"]);
}
