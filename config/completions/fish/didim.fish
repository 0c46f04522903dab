# Print an optspec for argparse to handle cmd's options that are independent of any subcommand.
function __fish_didim_global_optspecs
    string join \n h/help V/version
end

function __fish_didim_needs_command
    # Figure out if the current invocation already has a command.
    set -l cmd (commandline -opc)
    set -e cmd[1]
    argparse -s (__fish_didim_global_optspecs) -- $cmd 2>/dev/null
    or return
    if set -q argv[1]
        # Also print the command, so this can be used to figure out what it is.
        echo $argv[1]
        return 1
    end
    return 0
end

function __fish_didim_using_subcommand
    set -l cmd (__fish_didim_needs_command)
    test -z "$cmd"
    and return 1
    contains -- $cmd[1] $argv
end

complete -c didim -n "__fish_didim_needs_command" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_needs_command" -s V -l version -d 'Print version'
complete -c didim -n "__fish_didim_needs_command" -f -a "demo" -d 'Identify a simulated TX40: virtual drives, in-process bus, buffer, worker, table and figure'
complete -c didim -n "__fish_didim_needs_command" -f -a "run" -d 'Listen to a cell\'s bus and identify, until told to stop'
complete -c didim -n "__fish_didim_needs_command" -f -a "sim" -d 'Put the simulated TX40 on a bus'
complete -c didim -n "__fish_didim_needs_command" -f -a "replay" -d 'Send a candump log or an MCAP recording through the very same pipeline as `run`'
complete -c didim -n "__fish_didim_needs_command" -f -a "identify" -d 'Identify offline, from a CSV experiment, a candump log or an MCAP recording'
complete -c didim -n "__fish_didim_needs_command" -f -a "compare" -d 'Identify with every method and compare them'
complete -c didim -n "__fish_didim_needs_command" -f -a "study" -d 'Run a plan of simulated experiments: noise, errors of the model, methods, seeds'
complete -c didim -n "__fish_didim_needs_command" -f -a "convert" -d 'Convert between a CSV experiment, a candump log and an MCAP recording'
complete -c didim -n "__fish_didim_needs_command" -f -a "status" -d 'Show what a running service knows'
complete -c didim -n "__fish_didim_needs_command" -f -a "metrics" -d 'Tell Prometheus what a running service knows'
complete -c didim -n "__fish_didim_needs_command" -f -a "top" -d 'Watch a running service'
complete -c didim -n "__fish_didim_needs_command" -f -a "window" -d 'Open, close or identify the running service\'s window by hand'
complete -c didim -n "__fish_didim_needs_command" -f -a "reload" -d 'Have the running service read its cell file again'
complete -c didim -n "__fish_didim_needs_command" -f -a "capture" -d 'Keep a recording of the bus from now on'
complete -c didim -n "__fish_didim_needs_command" -f -a "note" -d 'Note payload, temperature or a text with the open window or the next one'
complete -c didim -n "__fish_didim_needs_command" -f -a "history" -d 'Show the results over time, beside the baseline'
complete -c didim -n "__fish_didim_needs_command" -f -a "baseline" -d 'Set, clear or show the result that later ones are compared with'
complete -c didim -n "__fish_didim_needs_command" -f -a "check" -d 'Say what would not work, before the service is started'
complete -c didim -n "__fish_didim_needs_command" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c didim -n "__fish_didim_using_subcommand demo" -l method -d 'The method' -r
complete -c didim -n "__fish_didim_using_subcommand demo" -l seconds -d 'How long the arm moves, rests included; its motion is repeated until then [default: once, 7.9 s]' -r
complete -c didim -n "__fish_didim_using_subcommand demo" -l seed -d 'Seed of the noise' -r
complete -c didim -n "__fish_didim_using_subcommand demo" -l figure -d 'Where the figure of measured against predicted torque goes' -r -F
complete -c didim -n "__fish_didim_using_subcommand demo" -l fast -d 'As fast as the pipeline takes the frames, not in real time'
complete -c didim -n "__fish_didim_using_subcommand demo" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand run" -l cell -d 'The cell file' -r -F
complete -c didim -n "__fish_didim_using_subcommand run" -l part -d 'The part of a service in two processes (`service.processes = "two"`)' -r -f -a "acquisition\t'Reads the bus'
estimation\t'Identifies, stores and answers'"
complete -c didim -n "__fish_didim_using_subcommand run" -l state -d 'Folder of the results, instead of the cell\'s `service.state_directory`' -r -F
complete -c didim -n "__fish_didim_using_subcommand run" -l runtime -d 'Folder of the sockets, instead of the cell\'s `service.runtime_directory`' -r -F
complete -c didim -n "__fish_didim_using_subcommand run" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c didim -n "__fish_didim_using_subcommand sim" -l cell -d 'The cell whose drives are simulated: it gives the layout of the frames and the gains' -r -F
complete -c didim -n "__fish_didim_using_subcommand sim" -l bus -d 'Where the frames go: can:INTERFACE, or log:FILE' -r
complete -c didim -n "__fish_didim_using_subcommand sim" -l scenario -d 'What is simulated: a scenario file, or one of the shipped tx40-paper, tx40-paper-errors and tx40-physical' -r
complete -c didim -n "__fish_didim_using_subcommand sim" -l seed -d 'Seed of the noise; the scenario\'s when left out' -r
complete -c didim -n "__fish_didim_using_subcommand sim" -l fast -d 'Send as fast as the bus takes frames, not at the cell\'s rate'
complete -c didim -n "__fish_didim_using_subcommand sim" -l repeat -d 'Play the motion again and again, until interrupted'
complete -c didim -n "__fish_didim_using_subcommand sim" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand replay" -l cell -d 'The cell file' -r -F
complete -c didim -n "__fish_didim_using_subcommand replay" -l state -d 'Keep the results in this folder, as `run` does; else only the last one is shown' -r -F
complete -c didim -n "__fish_didim_using_subcommand replay" -l figure -d 'Write a figure of measured against predicted torque (SVG)' -r -F
complete -c didim -n "__fish_didim_using_subcommand replay" -l report -d 'Write a report to show and to print (one HTML file)' -r -F
complete -c didim -n "__fish_didim_using_subcommand replay" -l json -d 'Print the last estimate as one JSON object and nothing else'
complete -c didim -n "__fish_didim_using_subcommand replay" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand identify" -l cell -d 'The cell file' -r -F
complete -c didim -n "__fish_didim_using_subcommand identify" -l input -d 'The experiment: a CSV file, or a candump log or an MCAP recording of the cell\'s bus' -r -F
complete -c didim -n "__fish_didim_using_subcommand identify" -l method -d 'The method; the cell\'s when left out' -r
complete -c didim -n "__fish_didim_using_subcommand identify" -l sample-rate -d 'Samples per second of a CSV file without a time_s column' -r
complete -c didim -n "__fish_didim_using_subcommand identify" -l from -d 'What counts begins here [s after the first sample]; before it is margin for the filters' -r
complete -c didim -n "__fish_didim_using_subcommand identify" -l to -d 'What counts ends here [s after the first sample]' -r
complete -c didim -n "__fish_didim_using_subcommand identify" -l figure -d 'Write a figure of measured against predicted torque (SVG)' -r -F
complete -c didim -n "__fish_didim_using_subcommand identify" -l report -d 'Write a report to show and to print (one HTML file)' -r -F
complete -c didim -n "__fish_didim_using_subcommand identify" -l json -d 'Print one JSON object and nothing else'
complete -c didim -n "__fish_didim_using_subcommand identify" -l essential -d 'Find the essential parameters among all base parameters, and identify these'
complete -c didim -n "__fish_didim_using_subcommand identify" -l regrouping -d 'Print how each regrouped parameter is made up'
complete -c didim -n "__fish_didim_using_subcommand identify" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand compare" -l cell -d 'The cell file' -r -F
complete -c didim -n "__fish_didim_using_subcommand compare" -l input -d 'The experiment: a CSV file, or a candump log or an MCAP recording of the cell\'s bus' -r -F
complete -c didim -n "__fish_didim_using_subcommand compare" -l scenario -d 'A simulated experiment instead, whose parameters are known: a scenario file, or the name of a shipped one' -r
complete -c didim -n "__fish_didim_using_subcommand compare" -l seed -d 'Seed of the noise; the scenario\'s when left out' -r
complete -c didim -n "__fish_didim_using_subcommand compare" -l methods -d 'The methods, separated by commas; all when left out. IDIM-LS, the reference, always runs' -r
complete -c didim -n "__fish_didim_using_subcommand compare" -l folds -d 'Consecutive blocks of samples, each predicted with what was found without it; 0 for none' -r
complete -c didim -n "__fish_didim_using_subcommand compare" -l published -d 'Published figures to stand beside (TOML)' -r -F
complete -c didim -n "__fish_didim_using_subcommand compare" -l limits -d 'Limits of what must come out (TOML); exit code 1 where it does not' -r -F
complete -c didim -n "__fish_didim_using_subcommand compare" -l markdown -d 'Write the tables for a document' -r -F
complete -c didim -n "__fish_didim_using_subcommand compare" -l figure -d 'Write the residuals\' autocorrelations of every method (SVG)' -r -F
complete -c didim -n "__fish_didim_using_subcommand compare" -l report -d 'Write a report to show and to print (one HTML file)' -r -F
complete -c didim -n "__fish_didim_using_subcommand compare" -l sample-rate -d 'Samples per second of a CSV file without a time_s column' -r
complete -c didim -n "__fish_didim_using_subcommand compare" -l from -d 'What counts begins here [s after the first sample]; before it is margin for the filters' -r
complete -c didim -n "__fish_didim_using_subcommand compare" -l to -d 'What counts ends here [s after the first sample]' -r
complete -c didim -n "__fish_didim_using_subcommand compare" -l json -d 'Print one JSON object and nothing else'
complete -c didim -n "__fish_didim_using_subcommand compare" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand study" -l plan -d 'The plan: methods, axes and levels' -r -F
complete -c didim -n "__fish_didim_using_subcommand study" -l out -d 'Where the runs and what they come to go; a study that is there is continued' -r -F
complete -c didim -n "__fish_didim_using_subcommand study" -l jobs -d 'Threads; as many as there are processors when left out' -r
complete -c didim -n "__fish_didim_using_subcommand study" -l json -d 'Print one JSON object and nothing else'
complete -c didim -n "__fish_didim_using_subcommand study" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand convert" -l cell -d 'The cell: its layout and gains are those of the log\'s frames' -r -F
complete -c didim -n "__fish_didim_using_subcommand convert" -l sample-rate -d 'Samples per second of a CSV file without a time_s column' -r
complete -c didim -n "__fish_didim_using_subcommand convert" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand status" -l cell -d 'The cell file of the service, for the folder of its sockets' -r -F
complete -c didim -n "__fish_didim_using_subcommand status" -l runtime -d 'The folder of its sockets [default: the cell\'s, or /run/didim]' -r -F
complete -c didim -n "__fish_didim_using_subcommand status" -l json -d 'Print one JSON object and nothing else'
complete -c didim -n "__fish_didim_using_subcommand status" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand metrics" -l cell -d 'The cell file of the service, for the folder of its sockets' -r -F
complete -c didim -n "__fish_didim_using_subcommand metrics" -l runtime -d 'The folder of its sockets [default: the cell\'s, or /run/didim]' -r -F
complete -c didim -n "__fish_didim_using_subcommand metrics" -l listen -d 'The address to answer at; only this machine may ask unless another is named' -r
complete -c didim -n "__fish_didim_using_subcommand metrics" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand top" -l cell -d 'The cell file of the service, for the folder of its sockets' -r -F
complete -c didim -n "__fish_didim_using_subcommand top" -l runtime -d 'The folder of its sockets [default: the cell\'s, or /run/didim]' -r -F
complete -c didim -n "__fish_didim_using_subcommand top" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand window" -l cell -d 'The cell file of the service, for the folder of its sockets' -r -F
complete -c didim -n "__fish_didim_using_subcommand window" -l runtime -d 'The folder of its sockets [default: the cell\'s, or /run/didim]' -r -F
complete -c didim -n "__fish_didim_using_subcommand window" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c didim -n "__fish_didim_using_subcommand reload" -l cell -d 'The cell file of the service, for the folder of its sockets' -r -F
complete -c didim -n "__fish_didim_using_subcommand reload" -l runtime -d 'The folder of its sockets [default: the cell\'s, or /run/didim]' -r -F
complete -c didim -n "__fish_didim_using_subcommand reload" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand capture; and not __fish_seen_subcommand_from start stop help" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand capture; and not __fish_seen_subcommand_from start stop help" -f -a "start" -d 'Begin a capture; the cell needs [service.recordings]'
complete -c didim -n "__fish_didim_using_subcommand capture; and not __fish_seen_subcommand_from start stop help" -f -a "stop" -d 'End it; the file is in the folder of kept recordings some seconds later'
complete -c didim -n "__fish_didim_using_subcommand capture; and not __fish_seen_subcommand_from start stop help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c didim -n "__fish_didim_using_subcommand capture; and __fish_seen_subcommand_from start" -l cell -d 'The cell file of the service, for the folder of its sockets' -r -F
complete -c didim -n "__fish_didim_using_subcommand capture; and __fish_seen_subcommand_from start" -l runtime -d 'The folder of its sockets [default: the cell\'s, or /run/didim]' -r -F
complete -c didim -n "__fish_didim_using_subcommand capture; and __fish_seen_subcommand_from start" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand capture; and __fish_seen_subcommand_from stop" -l cell -d 'The cell file of the service, for the folder of its sockets' -r -F
complete -c didim -n "__fish_didim_using_subcommand capture; and __fish_seen_subcommand_from stop" -l runtime -d 'The folder of its sockets [default: the cell\'s, or /run/didim]' -r -F
complete -c didim -n "__fish_didim_using_subcommand capture; and __fish_seen_subcommand_from stop" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand capture; and __fish_seen_subcommand_from help" -f -a "start" -d 'Begin a capture; the cell needs [service.recordings]'
complete -c didim -n "__fish_didim_using_subcommand capture; and __fish_seen_subcommand_from help" -f -a "stop" -d 'End it; the file is in the folder of kept recordings some seconds later'
complete -c didim -n "__fish_didim_using_subcommand capture; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c didim -n "__fish_didim_using_subcommand note" -l payload-kg -d 'Mass at the flange that the robot file does not describe; 0 means none, as with a baseline that has no note of one' -r
complete -c didim -n "__fish_didim_using_subcommand note" -l temperature-c -d 'Temperature of the arm' -r
complete -c didim -n "__fish_didim_using_subcommand note" -l text -d 'Anything else, in one line' -r
complete -c didim -n "__fish_didim_using_subcommand note" -l cell -d 'The cell file of the service, for the folder of its sockets' -r -F
complete -c didim -n "__fish_didim_using_subcommand note" -l runtime -d 'The folder of its sockets [default: the cell\'s, or /run/didim]' -r -F
complete -c didim -n "__fish_didim_using_subcommand note" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand history" -l cell -d 'The cell file of the service, for the folder of its results and for what it calls drift' -r -F
complete -c didim -n "__fish_didim_using_subcommand history" -l state -d 'The folder of its results [default: the cell\'s, or /var/lib/didim]' -r -F
complete -c didim -n "__fish_didim_using_subcommand history" -l parameter -d 'Plot this parameter over time; may be given more than once' -r
complete -c didim -n "__fish_didim_using_subcommand history" -l compare -d 'Put two results side by side' -r
complete -c didim -n "__fish_didim_using_subcommand history" -l last -d 'Show so many of the last results only' -r
complete -c didim -n "__fish_didim_using_subcommand history" -l report -d 'Write a report to show and to print (one HTML file)' -r -F
complete -c didim -n "__fish_didim_using_subcommand history" -l json -d 'Print one JSON object and nothing else'
complete -c didim -n "__fish_didim_using_subcommand history" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand baseline; and not __fish_seen_subcommand_from set clear show help" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand baseline; and not __fish_seen_subcommand_from set clear show help" -f -a "set" -d 'Compare later results with this one'
complete -c didim -n "__fish_didim_using_subcommand baseline; and not __fish_seen_subcommand_from set clear show help" -f -a "clear" -d 'Compare with none'
complete -c didim -n "__fish_didim_using_subcommand baseline; and not __fish_seen_subcommand_from set clear show help" -f -a "show" -d 'Show it'
complete -c didim -n "__fish_didim_using_subcommand baseline; and not __fish_seen_subcommand_from set clear show help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c didim -n "__fish_didim_using_subcommand baseline; and __fish_seen_subcommand_from set" -l cell -d 'The cell file of the service, for the folder of its sockets' -r -F
complete -c didim -n "__fish_didim_using_subcommand baseline; and __fish_seen_subcommand_from set" -l runtime -d 'The folder of its sockets [default: the cell\'s, or /run/didim]' -r -F
complete -c didim -n "__fish_didim_using_subcommand baseline; and __fish_seen_subcommand_from set" -l state -d 'This folder of results, instead of asking a running service; needs the right to write there' -r -F
complete -c didim -n "__fish_didim_using_subcommand baseline; and __fish_seen_subcommand_from set" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand baseline; and __fish_seen_subcommand_from clear" -l cell -d 'The cell file of the service, for the folder of its sockets' -r -F
complete -c didim -n "__fish_didim_using_subcommand baseline; and __fish_seen_subcommand_from clear" -l runtime -d 'The folder of its sockets [default: the cell\'s, or /run/didim]' -r -F
complete -c didim -n "__fish_didim_using_subcommand baseline; and __fish_seen_subcommand_from clear" -l state -d 'This folder of results, instead of asking a running service; needs the right to write there' -r -F
complete -c didim -n "__fish_didim_using_subcommand baseline; and __fish_seen_subcommand_from clear" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand baseline; and __fish_seen_subcommand_from show" -l cell -d 'The cell file of the service, for the folder of its results and for what it calls drift' -r -F
complete -c didim -n "__fish_didim_using_subcommand baseline; and __fish_seen_subcommand_from show" -l state -d 'The folder of its results [default: the cell\'s, or /var/lib/didim]' -r -F
complete -c didim -n "__fish_didim_using_subcommand baseline; and __fish_seen_subcommand_from show" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand baseline; and __fish_seen_subcommand_from help" -f -a "set" -d 'Compare later results with this one'
complete -c didim -n "__fish_didim_using_subcommand baseline; and __fish_seen_subcommand_from help" -f -a "clear" -d 'Compare with none'
complete -c didim -n "__fish_didim_using_subcommand baseline; and __fish_seen_subcommand_from help" -f -a "show" -d 'Show it'
complete -c didim -n "__fish_didim_using_subcommand baseline; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c didim -n "__fish_didim_using_subcommand check" -l cell -d 'The cell file' -r -F
complete -c didim -n "__fish_didim_using_subcommand check" -l elsewhere -d 'The cell is another machine\'s: pass over what this one has and has not'
complete -c didim -n "__fish_didim_using_subcommand check" -l json -d 'Print one JSON object and nothing else'
complete -c didim -n "__fish_didim_using_subcommand check" -s h -l help -d 'Print help'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "demo" -d 'Identify a simulated TX40: virtual drives, in-process bus, buffer, worker, table and figure'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "run" -d 'Listen to a cell\'s bus and identify, until told to stop'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "sim" -d 'Put the simulated TX40 on a bus'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "replay" -d 'Send a candump log or an MCAP recording through the very same pipeline as `run`'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "identify" -d 'Identify offline, from a CSV experiment, a candump log or an MCAP recording'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "compare" -d 'Identify with every method and compare them'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "study" -d 'Run a plan of simulated experiments: noise, errors of the model, methods, seeds'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "convert" -d 'Convert between a CSV experiment, a candump log and an MCAP recording'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "status" -d 'Show what a running service knows'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "metrics" -d 'Tell Prometheus what a running service knows'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "top" -d 'Watch a running service'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "window" -d 'Open, close or identify the running service\'s window by hand'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "reload" -d 'Have the running service read its cell file again'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "capture" -d 'Keep a recording of the bus from now on'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "note" -d 'Note payload, temperature or a text with the open window or the next one'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "history" -d 'Show the results over time, beside the baseline'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "baseline" -d 'Set, clear or show the result that later ones are compared with'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "check" -d 'Say what would not work, before the service is started'
complete -c didim -n "__fish_didim_using_subcommand help; and not __fish_seen_subcommand_from demo run sim replay identify compare study convert status metrics top window reload capture note history baseline check help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c didim -n "__fish_didim_using_subcommand help; and __fish_seen_subcommand_from capture" -f -a "start" -d 'Begin a capture; the cell needs [service.recordings]'
complete -c didim -n "__fish_didim_using_subcommand help; and __fish_seen_subcommand_from capture" -f -a "stop" -d 'End it; the file is in the folder of kept recordings some seconds later'
complete -c didim -n "__fish_didim_using_subcommand help; and __fish_seen_subcommand_from baseline" -f -a "set" -d 'Compare later results with this one'
complete -c didim -n "__fish_didim_using_subcommand help; and __fish_seen_subcommand_from baseline" -f -a "clear" -d 'Compare with none'
complete -c didim -n "__fish_didim_using_subcommand help; and __fish_seen_subcommand_from baseline" -f -a "show" -d 'Show it'
