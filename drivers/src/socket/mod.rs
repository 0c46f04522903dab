//! The socket options and system calls of SocketCAN that need unsafe code.
