/// Where a limit on the size of files is set (`ulimit -f`), the system ends a process that writes beyond it. After this call
/// the write fails instead, as on a full disk, and the error says so. Executables call it first of all.
pub fn survive_size_limits() {
    #[cfg(unix)]
    {
        // That the flag is set is not looked at: a handler of our own is all that is wanted.
        let flag = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(false));
        // Without it, only the message is missed.
        let _ = signal_hook::flag::register(rustix::process::Signal::XFSZ.as_raw(), flag);
    }
}
