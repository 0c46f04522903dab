//! The list of commands in the help of the program, in groups.

use std::fmt::Write as _;

/// Groups of commands, in the order in which users meet them.
pub(crate) const GROUPS: [(&str, &[&str]); 6] = [
    ("Start here", &["demo", "new", "robot", "check", "completions"]),
    (
        "Identify",
        &["identify", "predict", "external-torque", "compare", "payload", "gains", "convert"],
    ),
    ("Motions", &["advise", "design"]),
    ("Models", &["export"]),
    ("Studies", &["sim", "replay", "study"]),
    (
        "Service",
        &[
            "run", "status", "top", "metrics", "window", "note", "capture", "reload", "history",
            "report", "baseline", "fleet", "bundle", "state",
        ],
    ),
];

/// Returns the help template of a command with grouped subcommands.
pub(crate) fn grouped_help(command: &clap::Command) -> String {
    let mut text = "{about-with-newline}\n{usage-heading} {usage}\n".to_owned();
    for (group, names) in GROUPS {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "\n{group}:");
        for name in names {
            // The service is for Linux only.
            let Some(found) = command.find_subcommand(name) else { continue };
            let about = found.get_about().map(ToString::to_string).unwrap_or_default();
            let _ = writeln!(text, "  {name:15}  {about}");
        }
    }
    text + "\nOptions:\n{options}"
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::GROUPS;

    #[test]
    fn every_command_is_in_one_group() {
        let command = crate::command();
        let shown = command.get_subcommands().filter(|of| !of.is_hide_set());
        let shown: BTreeSet<&str> = shown.map(clap::Command::get_name).collect();
        let grouped: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| *names).copied().collect();
        assert_eq!(grouped.len(), shown.len());
        assert_eq!(grouped.into_iter().collect::<BTreeSet<_>>(), shown);
    }
}
