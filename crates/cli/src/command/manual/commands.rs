//! Parts of a command's man page besides its options: a description, examples, files and related
//! pages.

/// Additional parts of a command's man page.
pub(super) struct CommandPage {
    /// Words of the command: `baseline set`; empty for the program itself.
    pub(super) command: &'static str,
    pub(super) description: &'static str,
    /// Command lines, each with its purpose.
    pub(super) examples: &'static [[&'static str; 2]],
    pub(super) files: &'static [[&'static str; 2]],
    pub(super) see_also: &'static [&'static str],
}

const fn page(
    command: &'static str,
    description: &'static str,
    examples: &'static [[&'static str; 2]],
    files: &'static [[&'static str; 2]],
    see_also: &'static [&'static str],
) -> CommandPage {
    CommandPage { command, description, examples, files, see_also }
}

const SHARED_FILES: [&str; 2] = ["/usr/share/didim/config", "example cells, robots and layouts"];
const STATE_FILES: [&str; 2] = [
    "/var/lib/didim",
    "results, history, baseline and recordings, unless the cell names another folder",
];
const RUNTIME_FILES: [&str; 2] =
    ["/run/didim", "the sockets of the service, unless the cell names another folder"];
const SERVICE_CELL: [&str; 2] = ["/etc/didim/cell.toml", "the cell of the service"];
const FILES_OF_CELLS: &[[&str; 2]] = &[SHARED_FILES];

pub(super) const PAGES: &[CommandPage] = &[
    page(
        "",
        "didim listens to the drive bus of a robot, identifies the dynamic parameters of the arm \
         with their uncertainty, and keeps doing so. It never sends on the bus. The same methods \
         work on recordings: tables, logs of the bus, ROS 2 bags.",
        &[
            ["didim demo --fast", "see it work on a simulated arm"],
            [
                "didim new cell.toml --robot arm.urdf --log motion.csv",
                "write a cell for an arm of your own",
            ],
            [
                "didim identify --cell cell.toml --input motion.csv --report report.html",
                "identify it from a recording",
            ],
            ["didim run --cell cell.toml", "identify it while it works"],
        ],
        &[SERVICE_CELL, SHARED_FILES, STATE_FILES, RUNTIME_FILES],
        &["didim-cell(5)", "didim-robot(5)", "didim-parameters(7)"],
    ),
    page(
        "demo",
        "Simulates the drives of a TX40 on a bus inside the process, sends their frames through \
        the same pipeline as `run`, and prints the parameters next to the true ones.",
        &[[
            "didim demo --fast --figure torque.svg",
            "as fast as possible, with a figure of the torques",
        ]],
        &[],
        &["didim-sim(1)", "didim-parameters(7)"],
    ),
    page(
        "run",
        "Reads the bus of the cell, divides the motion into windows, identifies each, stores \
        results with a report and answers on its sockets, until it is stopped. With systemd the \
        units `didim.service` or `didim.target` start it.",
        &[
            ["didim run --cell /etc/didim/cell.toml", "the whole service in one process"],
            [
                "didim run --cell /etc/didim/cell.toml --part acquisition",
                "the half with the bus of a service in two",
            ],
        ],
        &[SERVICE_CELL, STATE_FILES, RUNTIME_FILES],
        &["didim-cell(5)", "didim-check(1)", "didim-status(1)", "didim-history(1)"],
    ),
    page(
        "sim",
        "Sends what the drives of a simulated arm would send, in the layout of the cell: on a \
        virtual CAN interface, or into a log. With --out, writes the signals of its motors as a \
        table, for a cell with or without a bus.",
        &[
            ["didim sim --cell cell.toml --bus log:drive.log --fast", "a log to try the cell with"],
            ["didim sim --cell cell.toml --bus can:vcan0 --repeat", "an arm on a virtual bus"],
            [
                "didim sim --cell cell.toml --bus log:next.log --motion next.csv",
                "the recording of a designed motion",
            ],
            ["didim sim --cell cell.toml --out arm.csv --json", "a table, and the true parameters"],
        ],
        FILES_OF_CELLS,
        &["didim-identify(1)", "didim-cell(5)"],
    ),
    page(
        "replay",
        "Sends a log or a recording through the windows of the service. The same file gives the \
        same results, byte for byte.",
        &[
            ["didim replay --cell cell.toml drive.log", "the last result of a log"],
            [
                "didim replay --cell cell.toml result-00000012.mcap --state again",
                "the stored result of a kept recording",
            ],
        ],
        &[STATE_FILES],
        &["didim-run(1)", "didim-identify(1)"],
    ),
    page(
        "identify",
        "Takes the whole of a measurement, or the part between `--from` and `--to`, and prints \
         the parameters with their standard deviations, units and a verdict for each use.",
        &[
            [
                "didim identify --cell cell.toml --input motion.csv --report report.html",
                "a table, with a report",
            ],
            [
                "didim identify --cell cell.toml --input monday.log --input tuesday.log",
                "two recordings in one identification",
            ],
            [
                "didim identify --cell cell.toml --input drive.log --essential",
                "find the parameters that the motion identifies",
            ],
            [
                "didim identify --cell cell.toml --input before.log --input next.log --designed \
                next.csv",
                "compare the standard deviations with those that a designed motion predicts",
            ],
        ],
        FILES_OF_CELLS,
        &["didim-cell(5)", "didim-parameters(7)", "didim-compare(1)", "didim-predict(1)"],
    ),
    page(
        "predict",
        "Compares the torques of a stored result with another recording, and the error with the \
         expected error.",
        &[[
            "didim predict --cell cell.toml --result result.json --input other.csv",
            "how well it predicts another motion",
        ]],
        &[STATE_FILES],
        &["didim-identify(1)", "didim-parameters(7)"],
    ),
    page(
        "external-torque",
        "Estimates the torque that the environment exerts on each joint, with its standard \
        deviation, by a momentum observer. Uses a result of the arm; its own payload, if it had \
        one, is part of the arm.",
        &[[
            "didim external-torque --cell cell.toml --result result.json --input other.csv --out \
            torque.csv",
            "and write the estimate at each sample",
        ]],
        &[STATE_FILES],
        &["didim-identify(1)", "didim-predict(1)", "didim-payload(1)"],
    ),
    page(
        "payload",
        "Finds mass, centre of mass and inertia of a load, from a recording with it and a \
         result of the arm without it.",
        &[[
            "didim payload --cell cell.toml --result empty.json --input loaded.csv \
            --declared-mass-kg 2.5",
            "and compare with the mass that is declared",
        ]],
        &[STATE_FILES],
        &["didim-identify(1)", "didim-note(1)"],
    ),
    page(
        "gains",
        "Finds the torque gain of each drive, from a recording of the empty arm and one with a \
            load of known mass and centre.",
        &[[
            "didim gains --cell cell.toml --input empty.log --loaded loaded.log --declared-mass-kg \
            2 --declared-centre-m 0,0,0.08",
            "and print lines for the cell file",
        ]],
        FILES_OF_CELLS,
        &["didim-payload(1)", "didim-cell(5)"],
    ),
    page(
        "export",
        "Finds physically consistent parameters that agree with the result, and writes them as a \
        model for other tools.",
        &[
            [
                "didim export --cell cell.toml --result result.json --to urdf --out arm.urdf",
                "into the robot's own URDF",
            ],
            [
                "didim export --cell cell.toml --result result.json --to c",
                "as C, on standard output",
            ],
        ],
        &[STATE_FILES],
        &["didim-robot(5)", "didim-identify(1)"],
    ),
    page(
        "advise",
        "Says what a stored result lacks. It lists the parameters that noise leaves more \
         uncertain than `parameter_uncertainty` of the cell allows, and the travel of the \
         joints concerned. It then proposes motions: the joint, its range, its speed, the \
         duration, and the standard deviation that follows. The program has tried each \
         proposal: motions of one joint and of two, from a few postures, within the limits of \
         `didim design`. It also lists what no motion changes. It moves nothing; `--out` writes \
         the motions as files for people to run.",
        &[
            ["didim advise result.json --cell cell.toml", "what is missing"],
            [
                "didim advise result.json --cell cell.toml --out next.csv",
                "the motions as files too, next-1.csv and so on",
            ],
        ],
        &[STATE_FILES],
        &["didim-design(1)", "didim-identify(1)", "didim-parameters(7)"],
    ),
    page(
        "design",
        "Designs a motion within the limits of the arm that makes the standard deviations of \
         its parameters small, in addition to the information of a result. The motion is a \
         finite Fourier series that begins and ends at rest. didim writes files for people to \
         run, and moves nothing.\n\nSpeeds, accelerations and jerks stay below half of the \
         robot file's limits unless you set `--speed`. Positions keep 5 % of the range from its \
         ends. Torques stay below 80 %, computed with the parameters of the result or the \
         nominal ones. If the robot file has `capsules` of the links, or the URDF has shapes \
         or meshes, unconnected links stay 20 mm apart, above the floor and inside the box of \
         `--box`. The floor of a URDF's arm is z = 0 of its base link, unless `--floor` or \
         `--no-plane` say otherwise. Nothing else is checked, and nothing at all without shapes; \
         the last line and the head of every file state the checks. Look at `--preview` and at \
         the motion in a simulation, and first run it at 10 % speed.\n\nPrograms for KUKA and \
         ABB visit the same positions, but their controllers choose the timing, so the figures \
         do not hold for them. With `--joints` the other joints stay at rest. `--objective \
         payload` makes the standard deviations of a load's parameters small, and prints those \
         of its mass, centre and inertia; torques then include the declared load. \
         `--friction-sweep` moves each joint there and back at six constant speeds, from a few \
         hundredths of its limit to half of it; slow ones are shortened to the available time. \
         The head of the file lists the friction terms that the motion can distinguish.",
        &[
            [
                "didim design --cell cell.toml --result result.json --duration 20 --out next.csv \
                --out next.yaml",
                "the motion that adds most to a result",
            ],
            [
                "didim design --robot arm.urdf --duration 20 --acceleration 5 --out first.script",
                "a first motion for an arm of which no parameters are known",
            ],
            [
                "didim design --cell cell.toml --result result.json --parameters ia4,ia5 \
                --duration 10 --out next.csv",
                "a motion for two parameters",
            ],
            [
                "didim design --cell cell.toml --result empty.json --objective payload --joints \
                3,4,5,6 --declared-mass-kg 1 --declared-centre-m 0,0,0.05 --duration 10 --out \
                load.csv",
                "a motion of elbow and wrist that identifies a load of about 1 kg",
            ],
            [
                "didim design --cell cell.toml --result result.json --friction-sweep 2,4 \
                --duration 60 --out sweep.csv",
                "joints 2 and 4 at constant speeds, for their friction laws",
            ],
            [
                "didim design --robot arm.toml --duration 20 --box=-0.8,-0.8,0,0.8,0.8,1.5 --out \
                next.csv --preview next.html",
                "inside a box, with a page to look at",
            ],
        ],
        &[STATE_FILES],
        &["didim-advise(1)", "didim-identify(1)", "didim-robot(5)", "didim-parameters(7)"],
    ),
    page(
        "compare",
        "Identifies one experiment with every method, and lists which agree, which predict \
         held-out data best, and which failed and why.",
        &[[
            "didim compare --cell cell.toml --input drive.log --report comparison.html",
            "with a report",
        ]],
        FILES_OF_CELLS,
        &["didim-identify(1)", "didim-study(1)"],
    ),
    page(
        "study",
        "Runs simulated experiments over levels of noise and errors of the model, with many seeds. \
        A study that was interrupted goes on where it was.",
        &[
            [
                "didim study --plan /usr/share/didim/config/studies/smoke.toml --out s --jobs 2",
                "the shortest shipped plan",
            ],
            [
                "didim study --plan plan.toml --shard 3/8 --out parts/3",
                "the fourth of eight machines",
            ],
            [
                "didim study --plan plan.toml --merge parts/* --out study",
                "what all of them have run",
            ],
        ],
        &[["/usr/share/didim/config/studies", "plans"]],
        &["didim-compare(1)"],
    ),
    page(
        "new",
        "Reads the available files of an arm and writes a commented cell file. A comment above \
         each value says if it was found, is assumed or is missing. On a terminal, didim asks \
         for missing values.",
        &[
            ["didim new cell.toml --robot arm.urdf --log motion.csv", "from a URDF and a table"],
            ["didim new cell.toml --robot arm.urdf --dbc drives.dbc --log drive.log", "of a bus"],
            [
                "didim new cell.toml --bag motion.mcap --set data.bag.effort.unit=Nm",
                "from a bag, with one question answered",
            ],
        ],
        FILES_OF_CELLS,
        &["didim-cell(5)", "didim-check(1)"],
    ),
    page(
        "robot",
        "Prints the axes, the reach and the base parameters of an arm, and draws it. Check both \
         before anything moves.",
        &[
            ["didim robot arm.urdf --picture arm.svg", "look at an arm"],
            ["didim robot arm.urdf --toml", "a URDF as a robot file"],
        ],
        &[["/usr/share/didim/config/robots", "robot files"]],
        &["didim-robot(5)", "didim-parameters(7)"],
    ),
    page(
        "convert",
        "The suffix of the output name selects the format: a table (.csv), an MCAP recording \
         (.mcap), else a candump log. A recording has the frames, and the curves of the joints \
         as joint states of ROS 2 for PlotJuggler and Foxglove.",
        &[
            [
                "didim convert --cell cell.toml drive.log curves.csv",
                "joint angles and torques of a log",
            ],
            ["didim convert --cell cell.toml motion.csv drive.mcap", "frames of a table"],
        ],
        &[],
        &["didim-cell(5)", "didim-replay(1)"],
    ),
    page(
        "status",
        "Asks the running service on its status socket; with two processes, both halves.",
        &[["didim status --json", "everything, as one object"]],
        &[RUNTIME_FILES],
        &["didim-top(1)", "didim-metrics(1)"],
    ),
    page(
        "metrics",
        "Serves the status of a running service over HTTP, in the text format of Prometheus.",
        &[["didim metrics --listen 127.0.0.1:9752", "to this machine only"]],
        &[RUNTIME_FILES, ["/etc/default/didim-metrics", "arguments of the unit"]],
        &["didim-status(1)"],
    ),
    page(
        "top",
        "Shows the status of a running service anew every second. q ends it.",
        &[["didim top --cell cell.toml", "of the service of this cell"]],
        &[RUNTIME_FILES],
        &["didim-status(1)", "didim-parameters(7)"],
    ),
    page(
        "window",
        "Sets the beginning or the end of a window of the running service.",
        &[["didim window identify", "identify the samples recorded so far"]],
        &[RUNTIME_FILES],
        &["didim-cell(5)", "didim-note(1)"],
    ),
    page(
        "reload",
        "Makes the running service read its cell file again. Changes of the bus are refused, \
         with the key, because they need a restart.",
        &[["didim reload", "after the cell file was changed"]],
        &[RUNTIME_FILES, SERVICE_CELL],
        &["didim-cell(5)", "didim-check(1)"],
    ),
    page(
        "capture",
        "Keeps the frames on the bus from now on in a recording of its own.",
        &[
            ["didim capture start gripper", "begin one with a name"],
            ["didim capture stop", "end it"],
        ],
        &[["/var/lib/didim/recordings/kept", "captures, unless the cell names another folder"]],
        &["didim-replay(1)", "didim-cell(5)"],
    ),
    page(
        "capture start",
        "Begins a capture. It ends by `capture stop`, or at the limits of the cell.",
        &[["didim capture start gripper", "with a name"]],
        &[RUNTIME_FILES],
        &["didim-capture(1)", "didim-cell(5)"],
    ),
    page(
        "capture stop",
        "Ends the capture that runs.",
        &[["didim capture stop", "the file follows some seconds later"]],
        &[RUNTIME_FILES],
        &["didim-capture(1)"],
    ),
    page(
        "note",
        "Stores facts that the bus does not carry, with the open window or with the next \
         identified one.",
        &[["didim note --payload-kg 2.5 --temperature-c 31", "payload and temperature"]],
        &[RUNTIME_FILES],
        &["didim-history(1)", "didim-payload(1)"],
    ),
    page(
        "history",
        "Reads the stored results; no service has to run.",
        &[
            ["didim history --last 20 --parameter fc3", "a parameter over time"],
            ["didim history --compare 8 65", "two results side by side"],
            ["didim history --report history.html", "every parameter, in one HTML file"],
            ["didim history --out history.parquet", "every parameter, for a database"],
            ["didim history --events --last 20", "changes of bus, machine and health"],
        ],
        &[STATE_FILES],
        &["didim-baseline(1)", "didim-parameters(7)"],
    ),
    page(
        "report",
        "Draws what is known of a stored result: verdict, parameters, and the comparison with the \
         baseline as of that result. While its recording is kept, it is identified again, and the \
         report has its curves. No service has to run.",
        &[
            ["didim report 42", "writes result-00000042.html"],
            ["didim report 42 --state /mnt/copy --out r.html", "from a copy of the results"],
        ],
        &[SERVICE_CELL, STATE_FILES],
        &["didim-history(1)", "didim-replay(1)"],
    ),
    page(
        "fleet",
        "Reads the files that `history --out` wrote for each arm. It takes the newest result of \
         each arm that is usable for monitoring and has no payload noted, and compares every \
         parameter with the median and the scatter of all arms.",
        &[
            [
                "didim fleet cabinet-1.csv cabinet-2.csv cabinet-3.csv",
                "histories of arms of one type, six at least",
            ],
            ["didim fleet all.parquet", "of all arms in one file"],
        ],
        &[],
        &["didim-history(1)", "didim-parameters(7)"],
    ),
    page(
        "bundle",
        "Packs versions, the files of the cell, status, events, history, baseline and a result \
         into one archive, and with `--recording` a kept recording, which `replay` opens. Of the \
         journal it takes the lines that name didim, and replaces the name of the machine. The \
         files of `didim-publish`, with its password, are not read. A part that is missing is \
         listed with its reason.",
        &[
            ["didim bundle arm.tar.zst", "what the service of this machine saw"],
            [
                "didim bundle arm.tar.zst --result 12 --recording result-00000012.mcap",
                "a result with its recording",
            ],
        ],
        &[STATE_FILES, RUNTIME_FILES],
        &["didim-replay(1)", "didim-history(1)", "didim-status(1)"],
    ),
    page(
        "state",
        "Rewrites results and baseline in the layout of an earlier version, and joins the history \
         in one file, in which a row of a day stands as a result. Compressed parts of the history \
         are moved to `newer/`, which no version reads. Stop the service first. This version reads \
         the folder as before.",
        &[["didim state --for 0.2", "before didim 0.2 is installed again"]],
        &[STATE_FILES],
        &["didim-history(1)", "didim-baseline(1)"],
    ),
    page(
        "baseline",
        "Later results are compared with the baseline, and a parameter that leaves its band raises \
        an alarm.",
        &[
            ["didim baseline set", "the arm is as it should be"],
            ["didim baseline show", "reference of later results"],
        ],
        &[STATE_FILES],
        &["didim-history(1)", "didim-cell(5)"],
    ),
    page(
        "baseline set",
        "Takes the last result that is usable for monitoring, or the one whose number is given.",
        &[["didim baseline set", "the last result"], ["didim baseline set 42", "result 42"]],
        &[STATE_FILES, RUNTIME_FILES],
        &["didim-baseline(1)", "didim-history(1)"],
    ),
    page(
        "baseline clear",
        "Removes the baseline: later results are not compared.",
        &[["didim baseline clear", "compare with none"]],
        &[STATE_FILES, RUNTIME_FILES],
        &["didim-baseline(1)"],
    ),
    page(
        "baseline show",
        "Prints the parameters of the baseline with their standard deviations.",
        &[["didim baseline show", "of the service on this machine"]],
        &[STATE_FILES],
        &["didim-baseline(1)", "didim-parameters(7)"],
    ),
    page(
        "check",
        "Reads a cell file and every file that it names, and inspects the machine: interface, \
         folders, memory, rights. The exit code is 78 if there is an error.",
        &[
            ["didim check --cell /etc/didim/cell.toml", "this cell on this machine"],
            ["didim check --cell cell.toml --other-machine", "the cell alone"],
        ],
        &[SERVICE_CELL, SHARED_FILES],
        &["didim-cell(5)", "didim-robot(5)", "didim-run(1)"],
    ),
    page(
        "completions",
        "Prints a script that makes a shell complete commands, options and files. Packages of \
         didim install it.",
        &[["didim completions bash", "what `source` reads in bash"]],
        &[],
        &[],
    ),
];
