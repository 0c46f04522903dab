//! The tables of keys, held to the types that read the files: what serde knows, requires and takes for a default.

use std::collections::{BTreeMap, BTreeSet};

use didim::cell::CellFile;
use didim_core::identification::Use;
use didim_core::robot::Robot;
use toml::{Table, Value};

use super::super::cell::CELL;
use super::super::reference::{Key, Kind, Presence, Reference, Section};
use super::super::robot::ROBOT;

/// What stands around the example of a section, so that it is a whole file.
const AROUND_CELL: &str = r#"
name = "test"
robot = "robot.toml"
[bus]
source = "can:can0"
[bus.layout]
dbc = "drives.dbc"
axes = 1
rate_hz = 500.0
position = { signal = "M.P", valid = "instant" }
torque = { signal = "M.T", valid = "instant" }
[[bus.drives]]
position = { scale = "rad", sign = 1, zero = 0.0, wraps = "refuse", provenance = "test" }
torque = { scale = "nm", sign = 1, provenance = "test" }
[window]
trigger = { by = "command" }
[identification]
method = "idim-ls"
position_filter = { cutoff_hz = 200.0 }
decimation_filter = { factor = 5 }
[service]
[controller]
kind = "bandwidth"
timing = { kind = "sampled", sample_period_s = 1e-3 }
bandwidth_hz = [10.0]
damping = 0.8
acceleration_feed_forward = true
"#;

const AROUND_ROBOT: &str = r#"
name = "test"
gravity_m_s2 = [0.0, 0.0, -9.81]
[[joint]]
type = "revolute"
alpha_deg = 0.0
d_m = 0.0
theta_deg = 0.0
r_m = 0.0
drive_inertia = true
position_min_deg = -90.0
position_max_deg = 90.0
velocity_max_rad_s = 1.0
torque_max_nm = 100.0
[transmission]
rows = [[100.0]]
[friction]
viscous = true
coulomb = true
offset = true
sign = { model = "sign" }
"#;

/// A kind of file: its keys, what stands around an example, and what reads it: what was read, or what is wrong.
struct File {
    keys: &'static Reference,
    around: &'static str,
    read: fn(&str) -> Result<String, String>,
}

const FILES: [File; 2] = [
    File {
        keys: &CELL,
        around: AROUND_CELL,
        read: |text| {
            let read = toml::from_str::<CellFile>(text);
            read.map(|cell| format!("{cell:?}")).map_err(|error| error.message().to_owned())
        },
    },
    File {
        keys: &ROBOT,
        around: AROUND_ROBOT,
        read: |text| {
            let read = Robot::from_toml(text);
            read.map(|robot| format!("{robot:?}")).map_err(|error| error.to_string())
        },
    },
];

impl File {
    /// A whole file with the example of a section in it.
    fn with(&self, section: &Section) -> Table {
        let mut file: Table = self.around.parse().unwrap();
        let example: Table =
            section.example.parse().unwrap_or_else(|error| panic!("{}: {error}", section.heading));
        overlay(&mut file, example);
        file
    }

    fn read_table(&self, file: &Table) -> Result<String, String> {
        (self.read)(&toml::to_string(file).unwrap())
    }
}

/// The example goes over what is there: tables join, unless they are of different forms, and all else is replaced.
fn overlay(file: &mut Table, example: Table) {
    for (key, value) in example {
        match (file.get_mut(&key), value) {
            (Some(Value::Table(there)), Value::Table(new)) if is_one_form(there, &new) => {
                overlay(there, new);
            }
            (_, value) => {
                file.insert(key, value);
            }
        }
    }
}

fn is_one_form(there: &Table, new: &Table) -> bool {
    ["kind", "by", "model"].iter().all(|tag| there.get(*tag) == new.get(*tag))
}

fn at<'a>(file: &'a mut Table, path: &str) -> Option<&'a mut Table> {
    let mut table = file;
    let mut steps = path.split('.').filter(|step| !step.is_empty()).peekable();
    while let Some(step) = steps.next() {
        let mut value = table.get_mut(step)?;
        while let Some(index) = steps.peek().and_then(|step| step.parse::<usize>().ok()) {
            value = value.as_array_mut()?.get_mut(index)?;
            steps.next();
        }
        table = value.as_table_mut()?;
    }
    Some(table)
}

/// What is between quotes of either kind in a message, from where it lists what is known.
fn listed(message: &str) -> BTreeSet<String> {
    // In a table that is a variant's.
    if let Some((_, list)) = message.split_once("available keys: ") {
        return list.split(", ").map(str::to_owned).collect();
    }
    let list = ["expected", "; use "].iter().find_map(|word| message.split_once(word));
    let list = list.map_or("", |(_, list)| list);
    list.split(['`', '"']).skip(1).step_by(2).map(str::to_owned).collect()
}

/// The sections of each table, which may have several forms or be told in several parts.
fn by_path(keys: &Reference) -> BTreeMap<&str, Vec<&'static Section>> {
    let mut paths: BTreeMap<&str, Vec<&'static Section>> = BTreeMap::new();
    for section in keys.sections() {
        paths.entry(section.path).or_default().push(section);
    }
    paths
}

fn is_form(key: &Key) -> bool {
    matches!(key.kind, Kind::Form(_))
}

/// Whether one key of the table, or its name as a text, is all that there may be.
fn is_choice(section: &Section) -> bool {
    section.keys.iter().all(|key| matches!(key.presence, Presence::Choice))
}

fn value(text: &str) -> Value {
    format!("value = {text}").parse::<Table>().unwrap().remove("value").unwrap()
}

#[test]
fn the_example_of_every_section_is_read_and_has_its_table() {
    for file in &FILES {
        for section in file.keys.sections() {
            let mut whole = file.with(section);
            let read = file.read_table(&whole);
            assert!(read.is_ok(), "{}: {read:?}", section.heading);
            let mut alone: Table = section.example.parse().unwrap();
            // A section of a table that is a text in the example shows another of its forms.
            let there = at(&mut alone, section.path).is_some();
            assert!(there, "{}: the example has no `{}`", section.heading, section.path);
            assert!(at(&mut whole, section.path).is_some());
            let form = section.keys.iter().find(|key| is_form(key));
            if let Some(Key { name, kind: Kind::Form(word), .. }) = form {
                let stated = at(&mut alone, section.path).unwrap().get(*name).cloned();
                assert_eq!(stated, Some((*word).into()), "{}", section.heading);
            }
        }
    }
}

/// A key that nothing knows is refused with those that there are: all of them are in the manual, and no others.
#[test]
fn the_manual_has_every_key_and_no_other() {
    let mut keys = 0;
    for file in &FILES {
        for (path, sections) in by_path(file.keys) {
            let names = |sections: &[&Section]| -> BTreeSet<String> {
                let keys = sections.iter().flat_map(|section| section.keys);
                keys.filter(|key| !is_form(key)).map(|key| key.name.to_owned()).collect()
            };
            // Each form of a tagged table has keys of its own; parts of one table are told together.
            let tagged = sections[0].keys.iter().any(is_form) && !path.ends_with("sign");
            let groups: Vec<Vec<&Section>> = if tagged {
                sections.iter().map(|section| vec![*section]).collect()
            } else {
                vec![sections.clone()]
            };
            for group in groups {
                let mut whole = file.with(group[0]);
                if is_choice(group[0]) {
                    let (above, name) = path.rsplit_once('.').unwrap();
                    at(&mut whole, above).unwrap().insert(name.to_owned(), "no-such-form".into());
                } else {
                    at(&mut whole, path).unwrap().insert("no_such_key".to_owned(), 1.into());
                }
                let message = file.read_table(&whole).unwrap_err();
                let refused =
                    ["unknown", "unexpected keys"].iter().any(|word| message.contains(word));
                assert!(refused, "{path}: {message}");
                let mut known = listed(&message);
                // Where the tag is not serde's own, it is a key as any other.
                known
                    .retain(|key| group[0].keys.iter().all(|own| !is_form(own) || own.name != key));
                assert_eq!(names(&group), known, "{}, `{path}`", file.keys.name);
                keys += known.len();
            }
        }
    }
    assert!(keys > 200, "{keys}");
}

#[test]
fn the_manual_has_every_form_and_every_word() {
    let mut words = 0;
    for file in &FILES {
        for (path, sections) in by_path(file.keys) {
            let mut stated: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
            for key in sections.iter().flat_map(|section| section.keys) {
                match key.kind {
                    Kind::Form(word) => {
                        stated.entry(key.name).or_default().insert(word.to_owned());
                    }
                    Kind::Word(all) => stated
                        .entry(key.name)
                        .or_default()
                        .extend(all.iter().map(|word| (*word).to_owned())),
                    _ => {}
                }
            }
            for (name, stated) in stated {
                let mut whole = file.with(sections[0]);
                let table = at(&mut whole, path).unwrap();
                table.insert(name.to_owned(), "no-such-word".into());
                if sections[0].keys.iter().any(|key| key.name == "model") {
                    table.retain(|key, _| key == "model");
                }
                let message = file.read_table(&whole).unwrap_err();
                assert_eq!(stated, listed(&message), "{path}.{name}: {message}");
                words += stated.len();
            }
        }
    }
    assert!(words > 40, "{words}");
}

#[test]
fn what_is_required_is_refused_when_it_is_missing_and_nothing_else_is() {
    for file in &FILES {
        for section in file.keys.sections().filter(|section| !is_choice(section)) {
            for key in section.keys {
                let mut whole = file.with(section);
                at(&mut whole, section.path).unwrap().remove(key.name);
                let read = file.read_table(&whole);
                let place = format!("{}, {}", section.heading, key.name);
                match (&key.presence, read) {
                    (Presence::Required, Err(message)) => {
                        assert!(message.contains(key.name), "{place}: {message}");
                    }
                    (Presence::Required, Ok(_)) => panic!("{place} may be left out"),
                    // Of a robot file: needed with another key, which says so.
                    (Presence::Optional(words), Err(_)) if words.starts_with("required") => {}
                    (_, Err(message)) => panic!("{place} may not be left out: {message}"),
                    (_, Ok(_)) => {}
                }
            }
        }
    }
}

#[test]
fn a_default_is_what_holds_where_the_key_is_left_out() {
    let mut defaults = 0;
    for file in &FILES {
        for section in file.keys.sections() {
            for key in section.keys {
                let Presence::Default(text) = key.presence else { continue };
                let mut whole = file.with(section);
                at(&mut whole, section.path).unwrap().remove(key.name);
                let without = file.read_table(&whole).unwrap();
                at(&mut whole, section.path).unwrap().insert(key.name.to_owned(), value(text));
                assert_eq!(
                    without,
                    file.read_table(&whole).unwrap(),
                    "{}: {}",
                    section.heading,
                    key.name
                );
                defaults += 1;
            }
        }
    }
    assert!(defaults > 60, "{defaults}");
}

/// What a key is refused for a value that it never takes says what it takes.
#[test]
fn types_are_those_that_are_read() {
    for file in &FILES {
        for section in file.keys.sections().filter(|section| !is_choice(section)) {
            for key in section.keys {
                let expected: &[&str] = match key.kind {
                    Kind::Number => &["f64"],
                    Kind::Whole => &["u8", "u16", "u32", "u64", "usize", "i64"],
                    Kind::Switch => &["a boolean"],
                    Kind::Text => &["a string"],
                    Kind::File => &["path string"],
                    // A list of three is a tuple.
                    Kind::Numbers | Kind::Texts | Kind::Tables => {
                        &["a sequence", "an array of length"]
                    }
                    Kind::Table | Kind::Word(_) | Kind::Form(_) | Kind::Other(_) => continue,
                };
                let wrong = if matches!(key.kind, Kind::Switch) { 1.5.into() } else { true.into() };
                let mut whole = file.with(section);
                at(&mut whole, section.path)
                    .unwrap()
                    .insert(key.name.to_owned(), Value::clone(&wrong));
                let message = file.read_table(&whole).unwrap_err();
                let said =
                    expected.iter().any(|kind| message.contains(&format!("expected {kind}")));
                assert!(said, "{}, {}: {message}", section.heading, key.name);
            }
        }
    }
}

/// Uses are entries of a list, whose words nothing above asks for.
#[test]
fn every_use_is_told() {
    let mut keys = CELL.sections().flat_map(|section| section.keys);
    let uses = keys.find(|key| key.name == "required_uses").unwrap();
    for each in Use::ALL {
        assert!(uses.meaning.contains(&format!("`\"{each}\"`")), "{each}");
    }
}

/// Every table that a key has is told in a section.
#[test]
fn every_table_has_a_section() {
    for file in &FILES {
        let paths: BTreeSet<String> = by_path(file.keys).into_keys().map(str::to_owned).collect();
        for section in file.keys.sections() {
            for key in section.keys {
                let entry = match key.kind {
                    Kind::Table => "",
                    Kind::Tables => ".0",
                    _ => continue,
                };
                let path = format!("{}.{}{entry}", section.path, key.name);
                let path = path.trim_start_matches('.');
                // The same law, of one joint.
                let told = path == "joint.0.friction.sign" || paths.contains(path);
                assert!(told, "no section of {path}");
            }
        }
    }
}

/// Units are part of the names of keys.
#[test]
fn units_are_those_of_the_names() {
    // Longer endings first.
    let endings = [
        ("velocity_nm_s_per_rad", "N·m·s/rad"),
        ("nm_per_a", "N·m/A"),
        ("ki_per_rad_s", "1/(rad·s)"),
        ("_s_per_rad", "s/rad"),
        ("_per_rad", "1/rad"),
        ("_per_s", "1/s"),
        ("_kg_m2", "kg·m²"),
        ("_rad_s2", "rad/s²"),
        ("_rad_s3", "rad/s³"),
        ("_rad_s", "rad/s"),
        ("_m_s2", "m/s²"),
        ("_m_s3", "m/s³"),
        ("_m_s", "m/s"),
        ("_n_m", "N/m"),
        ("_hz", "Hz"),
        ("_us", "µs"),
        ("_bps", "bit/s"),
        ("_bytes", "bytes"),
        ("_deviations", "σ"),
        ("_mb", "MB"),
        ("_db", "dB"),
        ("_deg", "°"),
        ("_rad", "rad"),
        ("_nm", "N·m"),
        ("_n", "N"),
        ("_a", "A"),
        ("_m", "m"),
        ("_s", "s"),
    ];
    let mut held = 0;
    for section in FILES.iter().flat_map(|file| file.keys.sections()) {
        for key in section.keys {
            if let Some((_, unit)) = endings.iter().find(|(ending, _)| key.name.ends_with(ending)) {
                assert_eq!(key.unit, *unit, "{}", key.name);
                held += 1;
            }
        }
    }
    assert!(held > 70, "{held}");
}
