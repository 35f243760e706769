//! Setting the camera up for measuring. The library takes any text for a setting and says nothing when the camera does not have
//! it; so every value is taken from the camera's own list, and read back.

use crate::camera::Camera;
use crate::choice;
use crate::fault::{self, Doing};
use crate::{recent, told};
use gphoto2::widget::{RadioWidget, Widget};
use weavelight::device::camera::tethered::protocol::{Configured, Fault, Setup};

/// What the library calls the exposure mode, and manual exposure, for different makers.
const PROGRAM: [&str; 2] = ["expprogram", "autoexposuremode"];
const MANUAL: [&str; 2] = ["M", "Manual"];
const QUALITY: [&str; 2] = ["imagequality", "imageformat"];
/// How many values a message names.
const NAMED: usize = 3;

/// Settings that must not differ between frames, where a camera has them at all. The picture goes from the camera's memory
/// straight here: a card is not needed and does not fill.
const PLAIN: [(&str, &[&str]); 5] = [
    ("capturetarget", &["Internal RAM"]),
    ("capturemode", &["Single Shot", "Single shot"]),
    ("autofocus", &["Off"]),
    ("autoiso", &["Off"]),
    ("longexpnr", &["Off"]),
];

/// Sets everything, and says what it was set to.
pub(crate) fn configure(camera: &Camera, setup: &Setup) -> Result<Configured, Fault> {
    camera.check_battery()?;
    let mut setter = Setter { camera, made: Vec::new() };
    setter.manual_exposure()?;
    for (name, wanted) in PLAIN {
        setter.set(name, wanted[0], |labels| choice::any_of(labels, wanted))?;
    }
    setter.first_of(&QUALITY, "RAW", choice::raw)?;
    setter.white_balance()?;
    let iso = setup.iso.to_string();
    setter.first_of(&["iso"], &iso, |labels| choice::iso(labels, setup.iso))?;
    let exposure_s = setter.exposure(setup.exposure_s)?;
    Ok(Configured { exposure_s, iso: setup.iso, settings: setter.made })
}

struct Setter<'a> {
    camera: &'a Camera,
    made: Vec<(String, String)>,
}

impl Setter<'_> {
    fn manual_exposure(&mut self) -> Result<(), Fault> {
        for name in PROGRAM {
            let Some(widget) = self.radio(name) else { continue };
            let mode = widget.choice();
            if MANUAL.contains(&mode.as_str()) {
                self.made.push((name.to_owned(), mode));
            } else if widget.readonly() {
                return Err(Fault::Dial { mode });
            } else {
                self.set(name, MANUAL[0], |labels| choice::any_of(labels, &MANUAL))
                    .map_err(|_| Fault::Dial { mode })?;
            }
        }
        Ok(())
    }

    /// A fixed one stays as it is.
    fn white_balance(&mut self) -> Result<(), Fault> {
        let name = "whitebalance";
        let current = self.radio(name).map(|widget| widget.choice()).unwrap_or_default();
        self.set(name, "a fixed one", |labels| choice::white_balance(labels, &current)).map(drop)
    }

    fn exposure(&mut self, wanted_s: f64) -> Result<f64, Fault> {
        let name = "shutterspeed";
        let wanted = format!("{wanted_s} s");
        let set = self.first_of(&[name], &wanted, |labels| choice::exposure(labels, wanted_s));
        let label = set.map_err(|fault| match (fault, self.radio(name)) {
            (Fault::NotOffered { setting, wanted, .. }, Some(widget)) => {
                let labels: Vec<String> = widget.choices_iter().collect();
                Fault::NotOffered { setting, wanted, offered: choice::near(&labels, wanted_s) }
            }
            (fault, _) => fault,
        })?;
        choice::seconds(&label).ok_or(Fault::NotTaken {
            setting: name.to_owned(),
            wanted,
            read: label,
        })
    }

    fn radio(&self, name: &str) -> Option<RadioWidget> {
        match self.camera.widget(name)? {
            Widget::Radio(widget) => Some(widget),
            _ => None,
        }
    }

    /// Sets the first of these that the camera has; it must have one.
    fn first_of(
        &mut self,
        names: &[&str],
        wanted: &str,
        pick: impl Fn(&[String]) -> Option<String>,
    ) -> Result<String, Fault> {
        for name in names {
            if let Some(label) = self.set(name, wanted, &pick)? {
                return Ok(label);
            }
        }
        if let Some(fault) = fault::of_link(&recent::log()) {
            return Err(fault);
        }
        let (setting, wanted) = (names[0].to_owned(), wanted.to_owned());
        Err(Fault::NotOffered { setting, wanted, offered: Vec::new() })
    }

    /// Sets what `pick` takes from the list. `None`: the camera does not have this setting.
    fn set(
        &mut self,
        name: &str,
        wanted: &str,
        pick: impl Fn(&[String]) -> Option<String>,
    ) -> Result<Option<String>, Fault> {
        let Some(widget) = self.radio(name) else { return Ok(None) };
        let labels: Vec<String> = widget.choices_iter().collect();
        let Some(label) = pick(&labels) else {
            let offered = labels.into_iter().take(NAMED).collect();
            let (setting, wanted) = (name.to_owned(), wanted.to_owned());
            return Err(Fault::NotOffered { setting, wanted, offered });
        };
        self.change(name, &widget, &label)?;
        self.made.push((name.to_owned(), label.clone()));
        Ok(Some(label))
    }

    /// The current value is read after setting only: before, it may be one that is not in the list, which the library tells
    /// as no value at all and its bindings do not expect.
    fn change(&self, name: &str, widget: &RadioWidget, label: &str) -> Result<(), Fault> {
        if !widget.readonly() {
            told(widget.set_choice(label), Doing::Using)?;
            told(self.camera.held.set_config(widget).wait(), Doing::Using)?;
        }
        match self.radio(name).map(|widget| widget.choice()) {
            Some(read) if read != label => {
                Err(Fault::NotTaken { setting: name.to_owned(), wanted: label.to_owned(), read })
            }
            _ => Ok(()),
        }
    }
}
