//! What a desktop finds the program by.

use std::path::Path;

fn beside(file: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("desktop").join(file)
}

/// The icon is drawn by the program; `WEAVELIGHT_ICON=write` writes it anew.
#[test]
fn the_icon_is_the_windows() {
    let icon = weavelight_app::ui::theme::icon();
    let file = beside("weavelight.png");
    if std::env::var_os("WEAVELIGHT_ICON").is_some() {
        let picture = image::RgbaImage::from_raw(icon.width, icon.height, icon.rgba.clone());
        picture.unwrap().save(&file).unwrap();
    }
    let kept = image::open(&file).unwrap().to_rgba8();
    assert_eq!((kept.width(), kept.height()), (icon.width, icon.height));
    assert!(kept.into_raw() == icon.rgba, "write it anew with WEAVELIGHT_ICON=write");
}

#[test]
fn the_desktop_entry_names_what_is_installed() {
    let entry = std::fs::read_to_string(beside("weavelight.desktop")).unwrap();
    for line in ["Exec=weavelight-app", "Icon=weavelight", "StartupWMClass=weavelight"] {
        assert!(entry.lines().any(|found| found == line), "{line}");
    }
    let makefile = Path::new(env!("CARGO_MANIFEST_DIR")).join("../Makefile");
    let makefile = std::fs::read_to_string(makefile).unwrap();
    assert!(makefile.contains("app/desktop/weavelight.desktop"));
    assert!(makefile.contains("app/desktop/weavelight.png"));
}
