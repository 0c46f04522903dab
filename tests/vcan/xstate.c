/* Lets the guest's kernel run on processors with AMX; preloaded into it by `run`.
 *
 * User-mode Linux, up to 6.12 at least, gives the floating-point registers of its processes back in a
 * buffer of fixed size. Linux takes no less than all of the processor's extended state, which with AMX
 * is 11 kB, and the guest's kernel dies of the refusal (`put_fp_registers`). Here what is given is
 * completed with what the process has: the registers that the guest does not know keep their values. */
#include <elf.h>
#include <errno.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

/* Sets the extended state of a process: the first bytes as given, the others as they are. */
static long set_extended_state(pid_t process, const struct iovec *given)
{
    static char state[1 << 16];
    struct iovec whole = { state, sizeof state };
    if (syscall(SYS_ptrace, PTRACE_GETREGSET, process, NT_X86_XSTATE, &whole) < 0)
        return -1;
    if (given->iov_len < whole.iov_len)
        memcpy(state, given->iov_base, given->iov_len);
    else
        whole = *given;
    return syscall(SYS_ptrace, PTRACE_SETREGSET, process, NT_X86_XSTATE, &whole);
}

/* In place of the C library's function of this name. */
long ptrace(enum __ptrace_request request, ...)
{
    va_list arguments;
    va_start(arguments, request);
    pid_t process = va_arg(arguments, pid_t);
    void *address = va_arg(arguments, void *);
    void *data = va_arg(arguments, void *);
    va_end(arguments);

    long word;
    switch (request) {
    case PTRACE_PEEKTEXT:
    case PTRACE_PEEKDATA:
    case PTRACE_PEEKUSER:
        /* The kernel writes the word, and the function returns it: only errno tells of an error. */
        if (syscall(SYS_ptrace, request, process, address, &word) < 0)
            return -1;
        errno = 0;
        return word;
    case PTRACE_SETREGSET:
        if ((long)address == NT_X86_XSTATE)
            return set_extended_state(process, data);
        break;
    default:
        break;
    }
    return syscall(SYS_ptrace, request, process, address, data);
}
