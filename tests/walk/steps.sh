# The steps of `tests/walkthrough`, in their order; sourced, not run.
# shellcheck shell=bash

readonly kept=/var/lib/didim/recordings/kept ring=/var/lib/didim/recordings/ring

walk_through() {
    introduction
    install_the_package
    describe_the_cell
    start_the_service
    let_frames_flow
    look_at_results
    watch_it
    keep_a_capture
    who_may_command
    change_the_configuration
    kill_it
    replay_a_recording
    run_two_processes
    run_two_arms
    remove_it
}

introduction() {
    cat >>"$walk/transcript" <<'END'

# A walk through an installation

A bare Debian with systemd, the package, a virtual CAN bus, and on it the simulated arm in the place of a
robot. `#` is root's prompt, `$` that of an ordinary user. What is printed is what came, in one run:
times, process numbers and rates differ from run to run. Between two commands the walk may wait for what
it names. The bus is in a guest (user-mode Linux) with one processor, where latencies are no measure of
anything; see [performance](performance.md). The [operations guide](../guide/operations.md) explains the
commands.
END
}

install_the_package() {
    section 'Install'
    root "dpkg --install ./$(basename "$WALK_PACKAGE")"
    root 'getent passwd didim; ls -ld /var/lib/didim; ls -A /etc/didim; ls /usr/share/didim/config/cells'
    expect '^didim:.*nologin$' '^drwxr-x--- .* didim didim ' 'tx40-packed-fd.toml'
    say 'Without a cell there is nothing to start; the journal says so, `systemctl start` does not:'
    root 'systemctl start didim; journalctl --sync; journalctl --unit didim --no-pager --output cat | grep skipped'
    expect 'skipped because .*ConditionPathExists=/etc/didim/cell.toml'
    root 'systemctl --version | head -n 1'
    local version
    version=$(sed -n 's/^systemd \([0-9]*\).*/\1/p' <<<"$output")
    ((version < 253)) || return 0
    say 'This systemd does not know `Type=notify-reload` yet (253 does): the drop-in of the installation guide.'
    root 'for unit in didim didim@ didim-acquire didim-estimate; do
    mkdir --parents /etc/systemd/system/$unit.service.d
    printf "[Service]\nType=notify\nExecReload=kill -HUP \$MAINPID\n" >/etc/systemd/system/$unit.service.d/reload.conf
done
systemctl daemon-reload'
}

describe_the_cell() {
    section 'Describe the cell'
    say 'An example, its names of files made absolute:'
    root "sed 's#\"\\.\\./#\"/usr/share/didim/config/#' /usr/share/didim/config/cells/tx40-packed-fd.toml >/etc/didim/cell.toml"
    say 'Edited for this cabinet: its drives send 1000 samples a second, it is small, and a slip of the pen.'
    root "sed -i -e 's/^rate_hz = 5000.0/rate_hz = 1000.0/' -e 's/factor = 125/factor = 25/' \\
    -e 's/sample_period_s = 2e-4/sample_period_s = 1e-3/' \\
    -e 's/^ring_mb = 1000/ring_mb = 64/; s/^keep_mb = 1000/keep_mb = 64/' \\
    -e 's/^min_s = 3.0/min_sec = 3.0/' /etc/didim/cell.toml"
    refused 78 'didim check --cell /etc/didim/cell.toml'
    expect 'min_sec' '^did you mean .min_s'
    root "sed -i -e 's/^min_sec/min_s/' /etc/didim/cell.toml"
    root 'didim check --cell /etc/didim/cell.toml'
    expect_not '^error'
    say 'This guest stamps frames when it comes to them, not when they came, so its frames count its cycles
(operations guide, “A bus that delivers in bursts”):'
    root "sed -i 's/^axes = 6/axes = 6\\ncycles_by = \"frames\"/' /etc/didim/cell.toml
diff /usr/share/didim/config/cells/tx40-packed-fd.toml /etc/didim/cell.toml; didim check --cell /etc/didim/cell.toml"
    expect 'cycles_by'
}

start_the_service() {
    section 'Start'
    root 'systemctl enable --now didim'
    root 'systemctl status didim | head -n 12'
    expect 'Active: active \(running\)' 'Status: "no window open, no estimate yet; no frame has come yet'
    refused 3 'didim status'
    expect '^health +no frame has come yet$' '^bus +no frame yet$' '^recording +no frame yet$'
}

let_frames_flow() {
    section 'Frames'
    say 'The arm is switched on: in the place of the robot, the simulated one, which moves again and again.'
    root 'didim sim --cell /etc/didim/cell.toml --bus can:vcan0 --repeat >/dev/null 2>&1 &'
    say 'What the bus does not tell is noted, for the window that comes:'
    root 'didim note --payload-kg 2.5 --temperature-c 31 --text "gripper B"'
    status_has '"state":"open"'
    root 'didim status'
    expect '^health +ok$' '^bus +ok$' '^window +open, [0-9]+ samples$' '^next window.s note +' \
        '^recording +[0-9]+ of 64 MB'
    result_is_there 0
    say 'When every motor has rested for half a second, the window is closed and identified.'
    root 'didim status'
    expect '^verdict +applicable$' '^last estimate +window 0, idim-ls, 28 parameters' '^health +ok$'
    root 'systemctl status didim | grep Status:'
    expect 'samples/s.*last estimate applicable'
    root 'journalctl --unit didim --no-pager --output cat'
    expect 'window identified'
    expect_not 'is not published'
}

look_at_results() {
    section 'Results, baseline, history'
    root 'ls -l /var/lib/didim'
    expect 'result-00000000.json' 'history.jsonl'
    root 'didim report 0 --out /tmp/report.html; head -c 15 /tmp/report.html'
    expect 'the report of result 0' '<!DOCTYPE html>'
    say 'The arm is as it should be: later results are compared with this one.'
    root 'didim baseline set 0; didim baseline show | head -n 5'
    expect 'result 0 .*, the baseline since' 'noted: 2.5 kg'
    say 'A window need not wait for the arm to rest:'
    # The shortest window has 3 s, and a motion 7: a slow machine has time to ask.
    status_has '"window":\{"state":"open","samples":[4-5][0-9]{3}\}'
    root 'didim window identify'
    result_is_there 1
    result_is_there 2
    root 'didim history'
    expect '^0 .* yes ' '2.5 kg' 'gripper B'
    root 'didim history --compare 0 2 | head -n 8'
    root 'didim status | tail -n 8'
    expect '^baseline +result 0 of' '^drift +every parameter in its band'
}

watch_it() {
    section 'Watch it'
    say '`didim top`, on a terminal of 110 × 40:'
    enter bash -c "(sleep 4; printf q) | script --quiet --return --command \
        'stty cols 110 rows 40; TERM=xterm NO_COLOR=1 didim top' /root/top.typescript" >/dev/null
    cp "$bare/root/top.typescript" "$walk/"
    printf '\n```text\n@top@\n```\n' >>"$walk/transcript"
    say 'And for Prometheus, by a process and a user of its own:'
    root 'systemctl enable --now didim-metrics'
    # What was left of the motion that was cut is no window: a reason until the next one is identified.
    eventually 'didim status | grep -qE "^health +ok$"'
    typed '#' 'exec 3<>/dev/tcp/127.0.0.1/9752; printf "GET /metrics HTTP/1.0\r\n\r\n" >&3
grep -E "^didim_(up|healthy|samples_total|cycles_lost_total|windows_identified_total|estimate_applicable) |fc3" <&3'
    expect '^didim_up 1$' '^didim_healthy 1$' '^didim_estimate_applicable 1$' 'parameter="fc3"'
}

keep_a_capture() {
    section 'Keep what is on the bus'
    root 'didim capture start gripper; sleep 3; didim capture stop'
    eventually "test -e $kept/capture-00000000-gripper.mcap"
    root "ls -l $kept $ring"
    expect 'capture-00000000-gripper.mcap' 'result-00000000.mcap' 'segment-00000000'
    refused 1 'didim capture stop'
    expect 'no capture is running'
}

who_may_command() {
    section 'Who may ask, and who may command'
    root 'ls -l /run/didim /dev/shm'
    expect '^srw-rw---- .* didim didim .* status.sock$' '^srw------- .* didim didim .* command.sock$'
    # Shared memory is its user's alone.
    expect '^-rw------- .* didim_.*data$'
    expect_not '^-...[^-].* didim_' '^-......[^-].* didim_'
    root 'useradd --groups didim engineer; useradd visitor'
    typed '$' 'didim status | head -n 3' runuser -u engineer --
    ((status == 0)) || fail 'a member of the group didim may not ask'
    expect '^cell +tx40-packed-fd'
    say 'A member of the group may ask, not command; anybody else not even ask:'
    typed '$' 'didim reload' runuser -u engineer --
    ((status == 1)) || fail 'a member of the group may command'
    expect "not allowed to use .*only the service's user may"
    typed '$' 'didim status' runuser -u visitor --
    ((status == 1)) || fail 'anybody may ask'
    expect 'not allowed to use .*become a member of its group'
}

change_the_configuration() {
    section 'Another configuration'
    root "sed -i 's/^min_s = 3.0/min_s = 2.0/' /etc/didim/cell.toml; systemctl reload didim"
    root 'didim status | head -n 3'
    expect '^health +ok$'
    say 'What takes a restart is refused as a whole, and the service goes on with what it has:'
    root "sed -i 's/^max_s = 60.0/max_s = 30.0/; s/can:vcan0/can:vcan1/' /etc/didim/cell.toml"
    refused 1 'didim reload'
    expect 'bus.source'
    root 'didim status | head -n 3; systemctl status didim | grep Status:'
    expect 'reload refused, the previous configuration stays in effect: .*bus.source'
    root "sed -i 's/can:vcan1/can:vcan0/' /etc/didim/cell.toml; didim reload; didim status | head -n 3"
    expect '^health +ok$'
}

kill_it() {
    section 'Killed'
    # A file that has just been begun has nothing whole in it, and is removed.
    eventually "find $ring -name '*.part' -size +100k | grep ."
    root "systemctl kill --signal=KILL didim; sleep 1; systemctl status didim | grep -E \"Active:|Main PID:\"; ls $ring"
    expect '(code=killed, signal=KILL)' '\.part$'
    # The next one is of the configuration of now.
    local before
    before=$(enter sh -c 'ls /var/lib/didim/result-*.json | wc -l')
    status_has '"bus":"ok"'
    eventually 'didim status --json | grep -qE "\"segments_repaired\":1"'
    say 'systemd starts it again after five seconds. The file that had no end was given one:'
    root "didim status; ls $ring"
    expect '^bus +ok$' '^baseline +result 0 of'
    result_is_there "$before"
    say 'Numbers go on where they were, and so does the history:'
    root 'didim history'
    expect "^$before .* yes "
}

replay_a_recording() {
    section 'The same result again'
    say 'A kept recording, with the program and the cell of now, gives the result of then:'
    local last
    last=$(enter sh -c 'ls /var/lib/didim/result-*.json | tail -n 1')
    last=${last##*/}
    eventually "test -e $kept/${last%.json}.mcap"
    root "didim replay --cell /etc/didim/cell.toml $kept/${last%.json}.mcap --state /tmp/again | tail -n 15"
    expect '^verdict: applicable'
    root "cmp /tmp/again/result-00000000.json /var/lib/didim/$last && echo the same bytes"
    expect 'the same bytes'
}

run_two_processes() {
    section 'In two processes'
    root "systemctl disable --now didim
sed -i 's/^\\[service\\]/[service]\\nprocesses = \"two\"/' /etc/didim/cell.toml
systemctl enable --now didim.target"
    status_has '"state":"open","samples":[0-9]{3}'
    root 'systemctl status didim-acquire didim-estimate | grep -E "^●|Active:|Main PID:|Status:"'
    expect 'didim-acquire.service' 'didim-estimate.service'
    local acquire
    acquire=$(enter systemctl show --property=MainPID --value didim-acquire)
    say 'The half that identifies is killed; the half that reads the bus does not notice.'
    root 'systemctl kill --signal=KILL didim-estimate; sleep 2; didim status | head -n 8'
    expect 'the estimation does not answer' '^bus +ok$'
    status_has '"estimation":\{'
    root 'systemctl status didim-acquire didim-estimate | grep -E "^●|Active:|Main PID:|Status:"'
    expect "Main PID: $acquire "
    say 'And the other way round:'
    root 'systemctl kill --signal=KILL didim-acquire; sleep 1; didim status | head -n 4'
    expect 'the acquisition does not answer'
    status_has '"restarts":1'
    local before
    before=$(enter sh -c 'ls /var/lib/didim/result-*.json | wc -l')
    result_is_there "$before"
    # What was left of the motion that was cut is no window: a reason until the next one is identified.
    eventually 'didim status | grep -qE "^health +ok$"'
    root "didim status; ls $kept"
    expect '^acquisition restarts +1$' '^verdict +applicable$' '^health +ok$' 'fault-[0-9]*-silence.mcap'
    expect_not '^recordings not kept'
}

run_two_arms() {
    section 'Two arms'
    say 'The target alone comes back before its halves have ended: who waits for them names them.'
    root 'systemctl disable --now didim.target; systemctl stop didim-acquire didim-estimate didim-metrics; ls /run/didim /dev/shm'
    expect_not 'sock$' 'didim_'
    say 'A cell for each arm, of 1000 samples a second on a bus of its own:'
    root "cd /etc/didim
sed -e 's/^name = .*/name = \"left\"/' -e '/^processes = /d' cell.toml >left.toml
sed -e 's/^name = .*/name = \"right\"/' -e 's/can:vcan0/can:vcan1/' left.toml >right.toml
didim sim --cell right.toml --bus can:vcan1 --repeat >/dev/null 2>&1 &
systemctl enable --now didim@left didim@right"
    root 'systemctl status didim@left didim@right | grep -E "^●|Active:"'
    expect 'didim@left.service' 'didim@right.service'
    local arm port=9753
    for arm in left right; do
        eventually "test -e /var/lib/didim/$arm/result-00000001.json"
        eventually "didim status --runtime /run/didim/$arm | grep -qE '^health +ok\$'"
        root "didim status --runtime /run/didim/$arm"
        expect "^cell +$arm " '^health +ok$' '^bus +ok$' '^verdict +applicable$'
        root "didim history --state /var/lib/didim/$arm"
        expect '^1 .* yes '
    done
    say 'Folders, sockets and names in shared memory are separate:'
    root 'ls /run/didim/left /run/didim/right /var/lib/didim/left; grep . /run/didim/*/ipc.prefix; ls /dev/shm | cut -d _ -f 1,2 | sort | uniq --count'
    expect '^status.sock$' '^history.jsonl$'
    (($(grep -cE '^ +[0-9]+ didim_[0-9a-f]{12}$' <<<"$output") == 2)) || fail 'the arms share names in shared memory'
    say 'So are the metrics:'
    for arm in left right; do
        root "echo 'DIDIM_METRICS_ARGUMENTS=\"--listen 127.0.0.1:$port\"' >/etc/default/didim-metrics-$arm
systemctl enable --now didim-metrics@$arm"
        eventually "exec 3<>/dev/tcp/127.0.0.1/$port"
        typed '#' "exec 3<>/dev/tcp/127.0.0.1/$port; printf \"GET /metrics HTTP/1.0\r\n\r\n\" >&3
grep -E \"^didim_(up|service_info|healthy|samples_total|estimate_applicable)[ {]\" <&3"
        expect '^didim_up 1$' '^didim_estimate_applicable 1$' "cell=\"$arm\""
        ((port += 1))
    done
    say 'One of them is killed; the other does not notice, and the killed one comes back.'
    root 'systemctl kill --signal=KILL didim@left; sleep 1; didim status --runtime /run/didim/right | head -n 7'
    expect '^cell +right ' '^bus +ok$'
    eventually 'didim status --runtime /run/didim/left'
}

remove_it() {
    section 'Remove'
    root 'systemctl stop didim@left didim@right; ls -R /run/didim /dev/shm'
    expect_not 'sock$' 'didim_'
    enter pkill --full 'didim sim' || true
    root 'dpkg --remove didim'
    root 'ls /etc/didim; ls /var/lib/didim | head -n 4'
    expect 'cell.toml' 'baseline.json'
    root 'dpkg --purge didim'
    refused 2 'ls -d /etc/didim /var/lib/didim /run/didim'
    root "find /etc -name '*didim*'; getent passwd didim"
}
