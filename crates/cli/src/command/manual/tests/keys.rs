//! Tests of the reference pages against the readers of the files: examples, known keys, required
//! keys and defaults.

use std::collections::{BTreeMap, BTreeSet};

use didim::cell::CellFile;
use didim_dynamics::robot::Robot;
use toml::{Table, Value};

use super::super::page::Block;
use super::super::reference::{Reference, Section, cell_file, robot_file};
use super::super::schema::{Key, Presence};

/// Text around the example of a section, which makes it a complete file.
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

/// A kind of file: its reference page, the text around an example, and its reader. The reader
/// returns the content or the error.
struct File {
    reference: Reference,
    around: &'static str,
    read: fn(&str) -> Result<String, String>,
}

fn files() -> [File; 2] {
    [
        File {
            reference: cell_file(),
            around: AROUND_CELL,
            read: |text| {
                let read = toml::from_str::<CellFile>(text);
                read.map(|cell| format!("{cell:?}")).map_err(|error| error.message().to_owned())
            },
        },
        File {
            reference: robot_file(),
            around: AROUND_ROBOT,
            read: |text| {
                let read = Robot::from_toml(text);
                read.map(|robot| format!("{robot:?}")).map_err(|error| error.to_string())
            },
        },
    ]
}

/// A section of a page: its table, keys and example.
struct Described {
    section: Section<'static>,
    keys: Vec<Key>,
    example: String,
}

impl Described {
    fn place(&self) -> String {
        format!("`{}` {}", self.section.path, self.section.form.unwrap_or_default())
    }

    /// Returns true if the table may have only one key, or the key's name as text.
    fn is_choice(&self) -> bool {
        self.keys.iter().all(|key| matches!(key.presence, Presence::Choice))
    }
}

impl File {
    fn sections(&self) -> Vec<Described> {
        let blocks = self.reference.blocks().unwrap();
        let tables = blocks.windows(2).filter_map(|pair| match pair {
            [(_, Some(section)), (Block::Example(example), _)] => Some((*section, example)),
            _ => None,
        });
        let sections: Vec<Described> = tables
            .map(|(section, example)| Described {
                section,
                keys: self.reference.keys(section).unwrap(),
                example: example.clone(),
            })
            .collect();
        let described = blocks.iter().filter(|(_, section)| section.is_some()).count();
        assert_eq!(sections.len(), described, "a section has no example");
        sections
    }

    /// Creates a complete file with the example of a section in it.
    fn with_example(&self, section: &Described) -> Table {
        let mut file: Table = self.around.parse().unwrap();
        let example: Table =
            section.example.parse().unwrap_or_else(|error| panic!("{}: {error}", section.place()));
        overlay(&mut file, example);
        file
    }

    fn read_table(&self, file: &Table) -> Result<String, String> {
        (self.read)(&toml::to_string(file).unwrap())
    }
}

/// Merges the example into the file. Tables are joined, unless they have different forms; other
/// values are replaced.
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

fn table_at<'a>(file: &'a mut Table, path: &str) -> Option<&'a mut Table> {
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

/// Returns the quoted words of a message, with quotes of either kind, from the list of known words
/// on.
fn listed(message: &str) -> BTreeSet<String> {
    // Message for a table of an enum variant.
    if let Some((_, list)) = message.split_once("available keys: ") {
        return list.split(", ").map(str::to_owned).collect();
    }
    let list = ["expected", "; use "].iter().find_map(|word| message.split_once(word));
    let list = list.map_or("", |(_, list)| list);
    list.split(['`', '"']).skip(1).step_by(2).map(str::to_owned).collect()
}

/// Returns the sections of each table, which may have several forms or be described in several
/// parts.
fn by_path(sections: &[Described]) -> BTreeMap<&str, Vec<&Described>> {
    let mut paths: BTreeMap<&str, Vec<&Described>> = BTreeMap::new();
    for section in sections {
        paths.entry(section.section.path).or_default().push(section);
    }
    paths
}

fn value(text: &str) -> Value {
    format!("value = {text}").parse::<Table>().unwrap().remove("value").unwrap()
}

#[test]
fn the_example_of_every_section_is_read_and_has_its_table() {
    for file in files() {
        for section in file.sections() {
            let (place, path) = (section.place(), section.section.path);
            let mut table = file.with_example(&section);
            let read = file.read_table(&table);
            assert!(read.is_ok(), "{place}: {read:?}");
            let mut alone: Table = section.example.parse().unwrap();
            // If the table is text in the example, the section shows another of its forms.
            assert!(table_at(&mut alone, path).is_some(), "{place}: the example has no table");
            assert!(table_at(&mut table, path).is_some());
            if let Some(form) = section.keys.iter().find(|key| key.is_form) {
                let value = table_at(&mut alone, path).unwrap().get(&form.name).cloned();
                assert_eq!(value, section.section.form.map(Value::from), "{place}");
            }
        }
    }
}

/// An unknown key is refused with a list of the known keys. The manual has all of these and no
/// others.
#[test]
fn the_manual_has_every_key_and_no_other() {
    let mut keys = 0;
    for file in files() {
        for (path, sections) in by_path(&file.sections()) {
            // Each form of a tagged table has its own keys; parts of one table are described
            // together.
            let tagged = sections[0].keys.iter().any(|key| key.is_form) && !path.ends_with("sign");
            let groups: Vec<&[&Described]> =
                if tagged { sections.chunks(1).collect() } else { vec![&sections] };
            for group in groups {
                let mut table = file.with_example(group[0]);
                if group[0].is_choice() {
                    let (above, name) = path.rsplit_once('.').unwrap();
                    table_at(&mut table, above)
                        .unwrap()
                        .insert(name.to_owned(), "no-such-form".into());
                } else {
                    table_at(&mut table, path).unwrap().insert("no_such_key".to_owned(), 1.into());
                }
                let message = file.read_table(&table).unwrap_err();
                let refused =
                    ["unknown", "unexpected keys"].iter().any(|word| message.contains(word));
                assert!(refused, "{path}: {message}");
                let of_group = || group.iter().flat_map(|section| &section.keys);
                let mut listed = listed(&message);
                // A tag that is not serde's own is a key like any other.
                listed.retain(|name| of_group().all(|key| !key.is_form || key.name != *name));
                let names: BTreeSet<String> =
                    of_group().filter(|key| !key.is_form).map(|key| key.name.clone()).collect();
                assert_eq!(names, listed, "{}, `{path}`", file.reference.name);
                keys += listed.len();
            }
        }
    }
    assert!(keys > 200, "{keys}");
}

#[test]
fn a_required_key_is_refused_when_it_is_missing_and_no_other_is() {
    for file in files() {
        for section in file.sections().iter().filter(|section| !section.is_choice()) {
            for key in &section.keys {
                let mut table = file.with_example(section);
                table_at(&mut table, section.section.path).unwrap().remove(&key.name);
                let read = file.read_table(&table);
                let place = format!("{}, {}", section.place(), key.name);
                match (&key.presence, read) {
                    (Presence::Required, Err(message)) => {
                        assert!(message.contains(&key.name), "{place}: {message}");
                    }
                    (Presence::Required, Ok(_)) => panic!("{place} may be left out"),
                    // In a robot file, a key may be required with another key, and its text says
                    // so.
                    (Presence::Optional(words), Err(_)) if words.starts_with("required") => {}
                    (_, Err(message)) => panic!("{place} may not be left out: {message}"),
                    (_, Ok(_)) => {}
                }
            }
        }
    }
}

#[test]
fn a_default_is_the_value_of_a_key_that_is_left_out() {
    let mut defaults = 0;
    for file in files() {
        for section in file.sections() {
            for key in &section.keys {
                let Presence::Default(text) = &key.presence else { continue };
                let mut table = file.with_example(&section);
                table_at(&mut table, section.section.path).unwrap().remove(&key.name);
                let without = file.read_table(&table).unwrap();
                table_at(&mut table, section.section.path)
                    .unwrap()
                    .insert(key.name.clone(), value(text));
                let with = file.read_table(&table).unwrap();
                assert_eq!(without, with, "{}: {}", section.place(), key.name);
                defaults += 1;
            }
        }
    }
    assert!(defaults > 60, "{defaults}");
}

/// Checks that every table of a key has a section.
#[test]
fn every_table_has_a_section() {
    for file in files() {
        let sections = file.sections();
        let paths: BTreeSet<&str> = by_path(&sections).into_keys().collect();
        for section in &sections {
            for key in &section.keys {
                let entry = match key.kind.as_str() {
                    "table" => "",
                    "list of tables" => ".0",
                    _ => continue,
                };
                let path = format!("{}.{}{entry}", section.section.path, key.name);
                let path = path.trim_start_matches('.');
                // Tables that a robot file or another section describes.
                let is_documented = paths.contains(path)
                    || path == "joint.0.friction.sign"
                    || path == "identification.sign"
                    || path.starts_with("urdf.");
                assert!(is_documented, "no section of {path}");
            }
        }
    }
}

/// Checks that units match the names of the keys.
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
    let mut checked = 0;
    for section in files().iter().flat_map(File::sections) {
        for key in &section.keys {
            if let Some((_, unit)) = endings.iter().find(|(ending, _)| key.name.ends_with(ending)) {
                assert_eq!(key.unit, *unit, "{}: {}", section.place(), key.name);
                checked += 1;
            }
        }
    }
    assert!(checked > 70, "{checked}");
}
