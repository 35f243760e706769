//! Whether every control says what it is to those who do not see it.

use eframe::egui::accesskit::Role;
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};

/// Every control of what is on the screen now.
pub(crate) fn check_names<State>(window: &Harness<'_, State>) {
    const CONTROLS: [Role; 9] = [
        Role::Button,
        Role::TextInput,
        Role::SpinButton,
        Role::CheckBox,
        Role::RadioButton,
        Role::ComboBox,
        Role::Slider,
        Role::Image,
        Role::Link,
    ];
    for role in CONTROLS {
        for control in window.query_all_by_role(role) {
            let node = control.accesskit_node();
            let named = node.label().is_some_and(|label| !label.trim().is_empty())
                || node.labelled_by().next().is_some();
            assert!(named, "a {role:?} without a name: {:?}", control.rect());
        }
    }
}
