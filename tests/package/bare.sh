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
