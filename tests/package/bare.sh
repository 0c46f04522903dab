# A bare Debian to install the package in; sourced, not run. Wants `folder`, where its archive is kept, and
# `bare`, where it is unpacked.
# shellcheck shell=bash

# shellcheck disable=SC1091 # the system's
codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")

# Whether it can be made here.
can_make_bare() {
    ((EUID == 0)) && [[ -n $codename ]] && { command -v mmdebstrap || command -v debootstrap; } >/dev/null
}

# make_bare_archive [PACKAGE…] : the bare system with these as an archive, made once for a release of
# Debian; its path in `archive`.
make_bare_archive() {
    local include sources=()
    include=$(IFS=,; echo "$*")
    archive=$folder/bare-$codename${include:+-${include//,/-}}.tar
    [[ ! -s $archive ]] || return 0
    if command -v mmdebstrap >/dev/null; then
        # From where this machine has its own packages.
        [[ ! -e /etc/apt/sources.list.d/debian.sources ]] ||
            sources=(/etc/apt/sources.list.d/debian.sources)
        mmdebstrap --quiet --variant=minbase --include="$include" "$codename" \
            "$archive.part" "${sources[@]}" --format=tar || return 1
    else
        local tree
        tree=$(mktemp -d)
        debootstrap --variant=minbase --include="$include" "$codename" "$tree" >/dev/null || return 1
        tar --create --file "$archive.part" --directory "$tree" . || return 1
        rm -rf "$tree"
    fi
    mv "$archive.part" "$archive"
}

unpack_bare() {
    tar --extract --file "$archive" --directory "$bare" --exclude='./dev/*'
}

# inside COMMAND… : in the bare system, as root.
inside() {
    env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
        chroot "$bare" "$@"
}

# as_didim COMMAND… : as the user of the service, without a privilege.
as_didim() {
    inside setpriv --reuid=didim --regid=didim --init-groups --no-new-privs --bounding-set=-all \
        --inh-caps=-all -- "$@"
}

# Tests of a suite, named in `suite`: how many passed, failed and were skipped.
passed=0 failed=0 skipped=0 mounted=()

cleanup() {
    local at
    for at in "${mounted[@]}"; do
        umount --lazy "$at" 2>/dev/null || true
    done
    [[ -z ${bare:-} ]] || rm -rf --one-file-system "$bare"
}

# try NAME COMMAND… : one test.
try() {
    local name=$1 output
    shift
    if output=$("$@" 2>&1); then
        printf 'test %s: %s ... ok\n' "$suite" "$name"
        ((passed += 1))
    else
        printf 'test %s: %s ... FAILED\n%s\n' "$suite" "$name" "$output"
        ((failed += 1))
    fi
}

skip() {
    printf 'test %s: %s ... ignored, %s\n' "$suite" "$1" "$2"
    ((skipped += 1))
}

finish() {
    printf '\ntest result: %d passed; %d failed; %d ignored\n' "$passed" "$failed" "$skipped"
    exit $((failed != 0))
}

# prepare_bare [PACKAGE…] : a bare system in which programs run, in `bare`.
prepare_bare() {
    bare=$(mktemp -d)
    chmod 755 "$bare"
    make_bare_archive "$@" || return 1
    unpack_bare
    mkdir -p "$bare"/{proc,dev/shm,tmp}
    mount -t proc proc "$bare/proc" && mounted+=("$bare/proc")
    mount -t tmpfs tmpfs "$bare/dev" && mounted=("$bare/dev" "${mounted[@]}")
    mkdir -m 1777 "$bare/dev/shm"
    local device
    for device in 'null 1 3' 'zero 1 5' 'random 1 8' 'urandom 1 9'; do
        # shellcheck disable=SC2086 # name, major, minor
        set -- $device
        mknod -m 666 "$bare/dev/$1" c "$2" "$3"
    done
}
