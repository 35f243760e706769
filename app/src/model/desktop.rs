//! What the desktop offers.

/// Whether something can show a dialogue for files; without, opening one looks as if the user had closed it. May take seconds.
#[cfg(target_os = "linux")]
pub fn has_dialogue() -> bool {
    has_portal() || has_program("zenity")
}

/// Other systems have one.
#[cfg(not(target_os = "linux"))]
pub fn has_dialogue() -> bool {
    true
}

/// Whether the desktop's portal can choose files: that needs a backend for this desktop.
#[cfg(target_os = "linux")]
fn has_portal() -> bool {
    use zbus::blocking::{Proxy, connection::Builder};
    // A portal that is not running yet is started by the question.
    const PATIENCE: std::time::Duration = std::time::Duration::from_secs(15);
    let version = || -> zbus::Result<u32> {
        let bus = Builder::session()?.method_timeout(PATIENCE).build()?;
        let chooser = Proxy::new(
            &bus,
            "org.freedesktop.portal.Desktop",
            "/org/freedesktop/portal/desktop",
            "org.freedesktop.portal.FileChooser",
        )?;
        chooser.get_property("version")
    };
    version().is_ok()
}

#[cfg(target_os = "linux")]
fn has_program(name: &str) -> bool {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder| folder.join(name).is_file())
}
