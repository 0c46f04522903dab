# What `setup` and `run` share; sourced by them, with their folder in `here`.
# shellcheck shell=bash

# Where the guest's parts are kept: outside the repository, shared by all its clones.
guest_folder=${DIDIM_VCAN_CACHE:-${XDG_CACHE_HOME:-${HOME:-/var/tmp}/.cache}/didim/vcan}/guest

# The CAN modules of the guest's kernel, in the order in which they depend on each other.
guest_modules=(can can-raw can-bcm can-dev vcan)

# The interfaces that every test finds, as the environment variable DIDIM_VCAN names them.
interfaces=(vcan0 vcan1)

# The largest receive buffer that the guest lets an ordinary socket ask for [bytes].
receive_buffer_limit=16777216

# The largest data field of CAN FD makes a frame of 72 bytes in the kernel.
can_fd_mtu=72

# fail MESSAGE… : ends with 125, which no test returns.
fail() {
    printf 'tests/vcan: %s\n' "$@" >&2
    exit 125
}

# Runs the command that follows as root of a network namespace of its own, whose processes all end
# with it. An ordinary user becomes root of a user namespace first.
namespace=(unshare --net --pid --fork --kill-child --mount-proc)
((EUID == 0)) || namespace+=(--user --map-root-user)

# Whether this machine's own kernel gives vcan to the calling user. In a namespace of its own, so
# that nothing is left behind; the kernel loads the module by itself if it has one.
host_offers_vcan() {
    "${namespace[@]}" ip link add dev vcan0 type vcan mtu "$can_fd_mtu" 2>/dev/null
}

# Whether this run may use the machine's own vcan; DIDIM_VCAN_KERNEL=guest insists on the guest.
host_is_used() {
    [[ ${DIDIM_VCAN_KERNEL:-host} == host ]] && host_offers_vcan
}

# What lets the guest's kernel run on processors with AMX. Named after its source, because clones of
# several versions share the folder.
xstate_source=$here/xstate.c
xstate_library=$guest_folder/xstate-$(sha256sum "$xstate_source" | cut -c 1-16).so

guest_is_set_up() {
    [[ -x $guest_folder/linux && -e $xstate_library ]]
}
