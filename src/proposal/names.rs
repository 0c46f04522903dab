//! Detection of the content of columns from their names.

use didim_formats::{AXIS_PLACEHOLDER, INDEX_PLACEHOLDER, TableNames};

/// Content of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ColumnMeaning {
    Position,
    Torque,
    Current,
    /// A commanded torque or current.
    Command,
    Reference,
    Time,
}

const TIME_WORDS: &[&str] = &["time", "t", "timestamp", "stamp", "zeit"];
const POSITION_WORDS: &[&str] = &[
    "position",
    "pos",
    "q",
    "angle",
    "theta",
    "encoder",
    "enc",
    "winkel",
    "istposition",
    "sollposition",
    "istwinkel",
    "sollwinkel",
];
const TORQUE_WORDS: &[&str] = &[
    "torque",
    "tau",
    "effort",
    "trq",
    "moment",
    "drehmoment",
    "istmoment",
    "sollmoment",
    "istdrehmoment",
];
const CURRENT_WORDS: &[&str] = &["current", "curr", "cur", "amp", "ampere"];
const AXIS_WORDS: &[&str] = &["axis", "axes", "achse"];
/// Words of the positions in a data set of LeRobot.
const STATE_WORDS: [&str; 2] = ["observation", "state"];
/// Words that mark the measured columns. They are used if a quantity has several groups of columns.
const MEASURED_WORDS: &[&str] = &[
    "actual",
    "measured",
    "meas",
    "act",
    "fbk",
    "feedback",
    "ist",
    "msr",
    "istposition",
    "istwinkel",
    "istmoment",
    "istdrehmoment",
];
const COMMAND_WORDS: &[&str] = &[
    "reference",
    "ref",
    "target",
    "desired",
    "des",
    "d",
    "cmd",
    "command",
    "commanded",
    "goal",
    "setpoint",
    "demand",
    "soll",
    "sollposition",
    "sollwinkel",
    "sollmoment",
];
/// Words that mark a column as a quantity that is not used.
const OTHER_WORDS: &[&str] = &[
    "velocity",
    "vel",
    "speed",
    "qd",
    "dq",
    "acceleration",
    "acc",
    "qdd",
    "ddq",
    "temperature",
    "temp",
    "external",
    "ext",
    "error",
    "err",
    "gravity",
    "feedforward",
    "ff",
    "friction",
    "limit",
    "status",
    "mode",
    "voltage",
    "secondary",
    "model",
    "residual",
    "estimated",
    "max",
    "min",
    "tcp",
    "cartesian",
    "offset",
];

/// Returns the words of a name in lower case, without its numbers.
pub(super) fn split_words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before = ' ';
    for c in name.chars() {
        let begins = c.is_uppercase() && before.is_lowercase();
        // Two words in capitals: `QMsr` is `Q` and `Msr`.
        let ends_capitals = c.is_lowercase() && before.is_uppercase();
        let capitals = words.last_mut().filter(|word| ends_capitals && word.len() > 1);
        if let Some(last) = capitals.and_then(String::pop) {
            words.push(last.into());
        }
        if !c.is_alphabetic() || begins {
            words.push(String::new());
        }
        if let (true, Some(word)) = (c.is_alphabetic(), words.last_mut()) {
            word.extend(c.to_lowercase());
        }
        before = c;
    }
    words.retain(|word| !word.is_empty());
    words
}

fn has_any_word(words: &[String], any: &[&str]) -> bool {
    words.iter().any(|word| any.contains(&word.as_str()))
}

/// Returns the content of a column. The name of a bus signal begins with the name of its message,
/// which shows if the signal is a command, but not its quantity.
pub(super) fn column_meaning(name: &str) -> Option<ColumnMeaning> {
    let name = &without_units(name);
    let all_words = split_words(name);
    let last_words = name.rsplit_once('.').map(|(_, own)| split_words(own));
    let words = last_words.filter(|own| !own.is_empty()).unwrap_or_else(|| all_words.clone());
    if has_any_word(&words, OTHER_WORDS) {
        return None;
    }
    let asked_for = has_any_word(&all_words, COMMAND_WORDS);
    if has_any_word(&words, TORQUE_WORDS) {
        Some(if asked_for { ColumnMeaning::Command } else { ColumnMeaning::Torque })
    } else if has_any_word(&words, CURRENT_WORDS) {
        (!asked_for).then_some(ColumnMeaning::Current)
    } else if has_any_word(&words, POSITION_WORDS) {
        Some(if asked_for { ColumnMeaning::Reference } else { ColumnMeaning::Position })
    } else if has_any_word(&words, TIME_WORDS) {
        Some(ColumnMeaning::Time)
    } else {
        // The measured axes are their positions.
        let is_axis = has_any_word(&words, AXIS_WORDS) && is_measured(name);
        (is_axis || all_words == STATE_WORDS).then_some(ColumnMeaning::Position)
    }
}

/// Returns a name without units in brackets and without placeholders. A name with the unit of a
/// speed, as rad/s, gets the word of a speed.
fn without_units(name: &str) -> String {
    let mut rest = name.to_owned();
    let is_speed = name.match_indices("/s").any(|(at, of)| {
        !name[at + of.len()..].starts_with(|c: char| c.is_alphanumeric() || c == '_')
    });
    while let Some((begin, _, end)) = bracketed(&rest) {
        rest.replace_range(begin..end, " ");
    }
    if is_speed {
        rest.push_str(" speed");
    }
    rest.replace(AXIS_PLACEHOLDER, " ").replace(INDEX_PLACEHOLDER, " ")
}

/// Returns the first text in brackets that is not the number of an axis: where its bracket begins,
/// the text, and where the other bracket ends.
fn bracketed(name: &str) -> Option<(usize, &str, usize)> {
    let mut begins = name.match_indices(['[', '(']).map(|(begin, _)| begin);
    begins.find_map(|begin| {
        let end = begin + name[begin..].find([']', ')'])?;
        let text = name[begin + 1..end].trim();
        let is_number = [AXIS_PLACEHOLDER, INDEX_PLACEHOLDER].contains(&text)
            || text.chars().any(|c| c.is_ascii_digit());
        (!text.is_empty() && !is_number).then_some((begin, text, end + 1))
    })
}

/// Returns true if a name marks a measured quantity.
pub(super) fn is_measured(name: &str) -> bool {
    has_any_word(&split_words(name), MEASURED_WORDS)
}

/// Returns true for the stamp in a message's header, which belongs to its signals.
pub(super) fn is_message_stamp(name: &str) -> bool {
    let words = split_words(name);
    ["header", "stamp"].into_iter().all(|word| words.iter().any(|own| own == word))
}

/// Last words of the two columns of a stamp: the whole seconds, and the remaining nanoseconds.
const STAMP_PARTS: [&[&str]; 2] =
    [&["sec", "secs", "seconds"], &["nanosec", "nsec", "nanosecs", "nsecs", "nanoseconds"]];

/// Finds pairs of columns that are the two parts of a stamp. Their names differ only in the last
/// word.
pub(super) fn stamp_pairs(columns: &[String]) -> Vec<[&String; 2]> {
    let stem = |name: &'_ String, part: usize| -> Option<String> {
        let parts_of_word = STAMP_PARTS[part].iter().filter_map(|word| {
            // The word begins after a character that is no letter, or with a capital.
            let at = name.len().checked_sub(word.len())?;
            let (stem, last) = name.split_at_checked(at)?;
            let begins =
                !stem.ends_with(char::is_alphabetic) || last.starts_with(char::is_uppercase);
            (begins && last.eq_ignore_ascii_case(word)).then(|| stem.to_owned())
        });
        // `NanoSec` ends with `Sec`; the longer word counts.
        let stem = parts_of_word.min_by_key(String::len)?;
        (part == 1 || !stem.to_lowercase().ends_with("nano")).then_some(stem)
    };
    let mut pairs = Vec::new();
    for sec in columns {
        let stem_of_name = stem(sec, 0);
        let nanosec =
            columns.iter().find(|other| stem_of_name.is_some() && stem(other, 1) == stem_of_name);
        pairs.extend(nanosec.map(|nanosec| [sec, nanosec]));
    }
    pairs
}

/// Columns of one quantity, one for each axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ColumnGroup {
    /// Name of the columns with a placeholder for the axis number.
    Numbered(String),
    /// Columns named after the joints.
    Named(Vec<String>),
    /// Columns without names of their own: what they have in common, and their numbers, from 1.
    ByNumber(String, Vec<String>),
}

impl ColumnGroup {
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Numbered(pattern) => pattern,
            Self::Named(names) => names.first().map_or("", String::as_str),
            Self::ByNumber(name, _) => name,
        }
    }

    /// Returns the name of the column of the first axis.
    pub(super) fn first_name(&self) -> String {
        match self {
            Self::Numbered(pattern) => axis_name(pattern, 0),
            Self::Named(names) | Self::ByNumber(_, names) => {
                names.first().cloned().unwrap_or_default()
            }
        }
    }

    pub(super) fn names(&self) -> Vec<String> {
        match self {
            Self::Numbered(pattern) => vec![pattern.clone()],
            Self::Named(names) | Self::ByNumber(_, names) => names.clone(),
        }
    }
}

/// Returns the name of an axis' column, from 0.
pub(super) fn axis_name(pattern: &str, axis: usize) -> String {
    let numbered = pattern.replace(AXIS_PLACEHOLDER, &(axis + 1).to_string());
    numbered.replace(INDEX_PLACEHOLDER, &axis.to_string())
}

/// Finds columns whose names differ by a number. Returns their name with a placeholder for the
/// number, which begins at 0 or 1, and the number of consecutive columns.
fn number_patterns(columns: &[String]) -> Vec<(String, usize)> {
    let is = |name: String| columns.contains(&name);
    let mut patterns = Vec::new();
    for column in columns {
        for number in number_ranges(column) {
            let (begin, end) = (&column[..number.start], &column[number.end..]);
            let first = match &column[number] {
                "0" => 0,
                "1" if !is(format!("{begin}0{end}")) => 1,
                _ => continue,
            };
            let count = (first..).take_while(|axis| is(format!("{begin}{axis}{end}"))).count();
            patterns.push((
                format!("{begin}{}{end}", [INDEX_PLACEHOLDER, AXIS_PLACEHOLDER][first]),
                count,
            ));
        }
    }
    patterns
}

/// Returns the groups of columns with a number that have one column per axis.
pub(super) fn numbered_groups(columns: &[String], axes: usize) -> Vec<ColumnGroup> {
    let patterns = number_patterns(columns).into_iter().filter(|(_, count)| *count == axes);
    patterns.map(|(pattern, _)| ColumnGroup::Numbered(pattern)).collect()
}

/// Returns all groups that have one column per axis. `joints` are the names of the joints.
pub(super) fn column_groups(
    table: &TableNames,
    axes: usize,
    joints: &[String],
) -> Vec<ColumnGroup> {
    if !table.has_header {
        return groups_without_header(table, axes, joints);
    }
    let columns = &table.columns;
    let is = |name: &String| columns.contains(name);
    let patterns = number_patterns(columns);
    let order = patterns
        .iter()
        .find_map(|(pattern, count)| joint_order(&pattern_texts(table, pattern, *count), joints));
    let in_lists = ListedNames::find(table, joints, &patterns);
    let mut groups: Vec<ColumnGroup> = match (order, in_lists) {
        // The names of the joints are no signals.
        (Some((order, listed)), _) => in_order(&patterns, &order, listed).collect(),
        (None, ListedNames::None) => numbered_groups(columns, axes),
        (None, ListedNames::Ordered(order, listed)) => {
            let (elements, others): (Vec<_>, Vec<_>) =
                patterns.into_iter().partition(|(pattern, _)| is_of_list(pattern));
            let others = others.into_iter().filter(|(_, count)| *count == axes);
            let others = others.map(|(pattern, _)| ColumnGroup::Numbered(pattern));
            in_order(&elements, &order, listed).chain(others).collect()
        }
        // Their order is not known.
        (None, ListedNames::Unknown) => {
            let mut numbered = numbered_groups(columns, axes);
            numbered.retain(|group| !is_of_list(group.name()));
            numbered
        }
    };
    groups.extend(repeated_names(columns, axes));
    let Some(first) = joints.first() else { return groups };
    for column in columns {
        let Some((begin, end)) = column.split_once(first.as_str()) else { continue };
        let names: Vec<String> =
            joints.iter().map(|joint| format!("{begin}{joint}{end}")).collect();
        // Joints with numbered names are found by their numbers.
        let numbered = groups.iter().any(|other| {
            matches!(other, ColumnGroup::Numbered(_)) && other.first_name() == names[0]
        });
        if !numbered && names.iter().all(is) {
            groups.push(ColumnGroup::Named(names));
        }
    }
    without_other_arms(groups, joints)
}

/// Removes numbered groups of a quantity that has columns named after the joints: `right_joint_1`
/// next to `left_joint_1` of this arm.
fn without_other_arms(groups: Vec<ColumnGroup>, joints: &[String]) -> Vec<ColumnGroup> {
    let is_of_arm = |group: &ColumnGroup| match group {
        ColumnGroup::Numbered(pattern) => joints
            .iter()
            .enumerate()
            .all(|(axis, joint)| axis_name(pattern, axis).contains(joint.as_str())),
        _ => true,
    };
    let is_named = |group: &ColumnGroup| match group {
        ColumnGroup::Numbered(_) => is_of_arm(group),
        ColumnGroup::Named(names) => names.iter().zip(joints).all(|(name, of)| name.contains(of)),
        ColumnGroup::ByNumber(..) => false,
    };
    let meaning = |group: &ColumnGroup| column_meaning(group.name());
    let named: Vec<_> = groups.iter().filter(|group| is_named(group)).filter_map(meaning).collect();
    let is_kept = |group: &ColumnGroup| {
        is_of_arm(group) || meaning(group).is_none_or(|meaning| !named.contains(&meaning))
    };
    groups.into_iter().filter(is_kept).collect()
}

/// Returns the groups of columns that all have one name.
fn repeated_names(columns: &[String], axes: usize) -> Vec<ColumnGroup> {
    let mut groups = Vec::new();
    for name in columns.iter().filter(|name| !name.is_empty()) {
        let alike = columns.iter().enumerate().filter(|(_, other)| *other == name);
        let numbers = alike.map(|(at, _)| (at + 1).to_string()).collect();
        let group = ColumnGroup::ByNumber(name.clone(), numbers);
        if axes > 1 && group.names().len() == axes && !groups.contains(&group) {
            groups.push(group);
        }
    }
    groups
}

/// Returns the texts of the first row in the columns of a pattern.
fn pattern_texts(table: &TableNames, pattern: &str, count: usize) -> Vec<String> {
    let names = (0..count).map(|axis| axis_name(pattern, axis));
    let columns = names.filter_map(|name| table.columns.iter().position(|own| *own == name));
    columns.filter_map(|column| table.first_row.get(column).cloned()).collect()
}

/// Returns the groups of several patterns with as many columns as a list has names, in an order.
fn in_order<'p>(
    patterns: &'p [(String, usize)],
    order: &'p [usize],
    listed: usize,
) -> impl Iterator<Item = ColumnGroup> + 'p {
    patterns
        .iter()
        .filter(move |(pattern, count)| *count == listed && column_meaning(pattern).is_some())
        .map(|(pattern, _)| order.iter().map(|at| axis_name(pattern, *at)).collect())
        .map(ColumnGroup::Named)
}

/// Returns true for the elements of lists in a field.
fn is_of_list(pattern: &str) -> bool {
    pattern.ends_with(&format!("[{INDEX_PLACEHOLDER}]"))
}

/// Names of joints that stand as a list in one field.
enum ListedNames {
    /// There is no list of names.
    None,
    /// Place of each joint of the arm in the list, and its length.
    Ordered(Vec<usize>, usize),
    /// The list has other names.
    Unknown,
}

impl ListedNames {
    fn find(table: &TableNames, joints: &[String], patterns: &[(String, usize)]) -> Self {
        let lists = table.first_row.iter().map(|text| listed_texts(text));
        let lists: Vec<Vec<String>> = lists.filter(|list| !list.is_empty()).collect();
        match lists.iter().find_map(|list| joint_order(list, joints)) {
            Some((order, listed)) => Self::Ordered(order, listed),
            None => {
                let is_named = |(pattern, count): &(String, usize)| {
                    is_of_list(pattern) && lists.iter().any(|list| list.len() == *count)
                };
                if patterns.iter().any(is_named) { Self::Unknown } else { Self::None }
            }
        }
    }
}

/// Returns the texts of a list in one field, as `['elbow', 'shoulder']`; none for numbers.
fn listed_texts(field: &str) -> Vec<String> {
    let field = field.trim();
    let brackets = [('[', ']'), ('(', ')')].into_iter();
    let mut inside = brackets.filter_map(|(begin, end)| {
        let (from, to) = (field.find(begin)?, field.rfind(end)?);
        (field.ends_with([end, ')']) && from < to).then(|| &field[from + 1..to])
    });
    let list = inside.next().unwrap_or_default();
    let quoted = list.split(['\'', '"']).skip(1).step_by(2).map(str::to_owned);
    quoted.collect()
}

/// Returns the place of each joint in a list of names, and the length of the list.
fn joint_order(texts: &[String], joints: &[String]) -> Option<(Vec<usize>, usize)> {
    // Drivers put the name of the arm before that of the joint: `arm/elbow`.
    let name = |text: &'_ String| text.rsplit('/').next().unwrap_or_default().to_owned();
    let place = |joint: &String| texts.iter().position(|text| name(text) == *joint);
    let order: Vec<usize> = joints.iter().map(place).collect::<Option<_>>()?;
    (!order.is_empty()).then_some((order, texts.len()))
}

/// Names of the quantities after the names of joints, in a row of `sensor_msgs/msg/JointState`.
const JOINT_STATE_LISTS: [&str; 3] = ["position", "velocity", "effort"];

/// Returns true for joint states without a header whose rows have the names of the joints and
/// positions, with velocities or without, and no efforts.
pub(super) fn lacks_efforts(table: &TableNames, joints: &[String]) -> bool {
    if table.has_header || !groups_without_header(table, joints.len(), joints).is_empty() {
        return false;
    }
    let columns = table.first_row.len();
    let is_joint = |text: &String| joints.contains(text);
    let Some(first) = table.first_row.iter().position(is_joint) else { return false };
    (0..=first).rev().any(|begin| {
        (1..JOINT_STATE_LISTS.len()).any(|lists| {
            let listed = (columns - begin) / (lists + 1);
            let is_state = columns == begin + (lists + 1) * listed;
            let texts = table.first_row.get(begin..begin + listed).filter(|_| is_state);
            let values = table.first_row.get(begin + listed..).unwrap_or_default();
            let is_number = |text: &String| text.parse::<f64>().is_ok();
            texts.is_some_and(|texts| {
                joint_order(texts, joints).is_some() && !texts.iter().any(is_number)
            }) && values.iter().all(is_number)
        })
    })
}

/// Returns the groups of a table without a header: those of joint states (`ros2 topic echo --csv`),
/// whose rows have the names of the joints; or positions and torques after the time.
fn groups_without_header(table: &TableNames, axes: usize, joints: &[String]) -> Vec<ColumnGroup> {
    let columns = table.first_row.len();
    let number = |column: usize| (column + 1).to_string();
    let is_joint = |text: &String| joints.contains(text);
    if let Some(first) = table.first_row.iter().position(is_joint) {
        // Other joints may stand before the first one of the arm.
        let order = (0..=first).rev().find_map(|begin| {
            let listed = (columns - begin) / (JOINT_STATE_LISTS.len() + 1);
            let is_state = columns == begin + (JOINT_STATE_LISTS.len() + 1) * listed;
            let texts = table.first_row.get(begin..begin + listed).filter(|_| is_state)?;
            joint_order(texts, joints).map(|(order, listed)| (begin, order, listed))
        });
        let Some((begin, order, listed)) = order else { return Vec::new() };
        let lists = (1..).zip(JOINT_STATE_LISTS).map(|(list, name)| {
            let numbers = order.iter().map(|at| number(begin + list * listed + at)).collect();
            ColumnGroup::ByNumber(name.to_owned(), numbers)
        });
        return lists.collect();
    }
    if columns != 1 + 2 * axes {
        return Vec::new();
    }
    let group = |name: &str, begin: usize| {
        ColumnGroup::ByNumber(name.to_owned(), (begin..begin + axes).map(number).collect())
    };
    vec![group("position", 1), group("torque", 1 + axes)]
}

/// Returns the positions of the numbers in a name.
fn number_ranges(name: &str) -> Vec<core::ops::Range<usize>> {
    let mut runs: Vec<core::ops::Range<usize>> = Vec::new();
    for (at, c) in name.char_indices().filter(|(_, c)| c.is_ascii_digit()) {
        match runs.last_mut() {
            Some(last) if last.end == at => last.end = at + c.len_utf8(),
            _ => runs.push(at..at + c.len_utf8()),
        }
    }
    runs
}

/// Returns the unit in a name: in brackets, or as its last word. An unknown word in brackets also
/// counts as a unit.
pub(super) fn unit<'a>(name: &str, units: &[(&str, &'a str)]) -> Option<Result<&'a str, String>> {
    let unit_of = |configured: &str| {
        let lowercase = configured.to_lowercase().replace(['.', '·', '*', ' '], "");
        units.iter().find(|(word, _)| *word == lowercase).map(|(_, unit)| *unit)
    };
    if let Some((_, configured_value, _)) = bracketed(name) {
        return Some(unit_of(configured_value).ok_or_else(|| configured_value.to_owned()));
    }
    let plain_name = name.replace(AXIS_PLACEHOLDER, "").replace(INDEX_PLACEHOLDER, "");
    let mut words =
        plain_name.split(|c: char| !c.is_alphabetic() && c != '°').filter(|word| !word.is_empty());
    let last = words.next_back()?;
    let is_other = OTHER_UNITS.contains(&last.to_lowercase().as_str());
    unit_of(last).map(Ok).or_else(|| is_other.then(|| Err(last.to_owned())))
}

/// Units that are not supported and may be the last word of a name.
const OTHER_UNITS: &[&str] =
    &["ma", "percent", "permille", "pct", "counts", "ticks", "inc", "min", "grad", "rpm"];

/// Returns the names of other groups of the same quantity by their words, also of those that are
/// not used, such as errors and filtered signals.
pub(super) fn related_groups(groups: &[ColumnGroup], chosen: &ColumnGroup) -> Vec<String> {
    let quantities = [POSITION_WORDS, TORQUE_WORDS, CURRENT_WORDS];
    let is_of = |group: &ColumnGroup, words: &[&str]| {
        has_any_word(&split_words(&without_units(group.name())), words)
    };
    let Some(words) = quantities.into_iter().find(|words| is_of(chosen, words)) else {
        return Vec::new();
    };
    let others = groups.iter().filter(|group| *group != chosen && is_of(group, words));
    others.map(|group| format!("`{}`", group.name())).collect()
}

/// Returns true for a column that is one of several with a number.
pub(super) fn is_numbered(columns: &[String], name: &str) -> bool {
    number_patterns(columns).iter().any(|(pattern, count)| {
        *count > 1 && (0..*count).any(|axis| axis_name(pattern, axis) == name)
    })
}

/// Lists the quantities whose number of columns differs from the number of axes, each with its
/// number of columns.
pub(super) fn counted_otherwise(columns: &[String], axes: usize) -> Vec<String> {
    let patterns = number_patterns(columns).into_iter();
    let otherwise = patterns.filter(|(pattern, count)| {
        *count > 1 && *count != axes && column_meaning(pattern).is_some()
    });
    otherwise.map(|(pattern, count)| format!("`{pattern}` {count} times")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_columns_of_a_data_recorder_are_known() {
        assert_eq!(split_words("axisQMsr_LBR[0]"), ["axis", "q", "msr", "lbr"]);
        let columns = ["ZeitInSec", "ZeitInNanoSec", "stamp_sec", "stamp_nanosec", "parsec"];
        let columns = columns.map(str::to_owned);
        let pairs = stamp_pairs(&columns);
        assert_eq!(pairs, [[&columns[0], &columns[1]], [&columns[2], &columns[3]]]);
        for (name, meaning) in [
            ("axisQMsr_LBR[0]", ColumnMeaning::Position),
            ("axisTauMsr_LBR[0]", ColumnMeaning::Torque),
        ] {
            assert_eq!(column_meaning(name), Some(meaning), "{name}");
        }
    }
}
