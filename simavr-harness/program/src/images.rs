//! The images that modules are flashed with.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use simavr_harness::{Image, ImageError, Images};
use simulation::{OtherImages, Scenario};

use super::arguments::{CoreName, Sim, Source};

/// The images that `./x build` leaves in a directory.
pub fn load_images(directory: &Path, core: CoreName) -> Result<Images, Box<dyn Error>> {
    let load = |name| load(&directory.join(name), core);
    Ok(Images { master: load("firmware-master.elf")?, slave: load("firmware-slave.elf")? })
}

/// The images of all modules.
pub struct Flashed {
    pub rest: Images,
    /// The images of the modules for which the robot file names others, by module.
    pub others: BTreeMap<usize, Images>,
}

impl Flashed {
    /// Loads all images of a robot, and checks that modules can run with them.
    ///
    /// # Errors
    /// An image is missing, or modules can't run with it; the message says what to do.
    pub fn load(scenario: &Scenario, options: &Sim) -> Result<Self, Box<dyn Error>> {
        let core = options.core();
        let directory = match &options.robot {
            Source::File(path) => path.parent(),
            Source::Shape(_) => None,
        };
        let rest = load_images(&options.images, core)?;
        let other = |path: &Option<PathBuf>, of_rest: &Arc<Image>| match path {
            Some(path) => load_other(&directory.unwrap_or(Path::new("")).join(path), core),
            None => Ok(Arc::clone(of_rest)),
        };
        let mut others = BTreeMap::new();
        for OtherImages { modules, master, slave } in &scenario.images {
            let images = Images { master: other(master, &rest.master)?, slave: other(slave, &rest.slave)? };
            others.extend(modules.iter().map(|&module| (module, images.clone())));
        }
        let flashed = Flashed { rest, others };
        flashed.check(scenario)?;
        Ok(flashed)
    }

    fn check(&self, scenario: &Scenario) -> Result<(), Box<dyn Error>> {
        const NO_STATUS: &str = "the master's image has no MODULE_STATUS: build both with `./x build`";
        let has_status = |images: &Images| images.master.symbol("MODULE_STATUS").is_some();
        if !has_status(&self.rest) {
            return Err(NO_STATUS.into());
        }
        if let Some((module, _)) = self.others.iter().find(|(_, images)| !has_status(images)) {
            return Err(format!("module {module}: {NO_STATUS}").into());
        }
        for face in scenario.wiring.faces() {
            let images = self.others.get(&face.module).unwrap_or(&self.rest);
            images.expect_link(face.dock).map_err(|error| format!("module {}: {error}", face.module))?;
        }
        Ok(())
    }
}

fn load_other(path: &Path, core: CoreName) -> Result<Arc<Image>, Box<dyn Error>> {
    if !path.is_file() {
        return Err(format!(
            "there is no image {}: `master` and `slave` of an [[image]] are paths from the robot file's \
             directory",
            path.display()
        )
        .into());
    }
    Ok(load(path, core)?)
}

fn load(path: &Path, core: CoreName) -> Result<Arc<Image>, ImageError> {
    let image = Image::load(path)?;
    Ok(Arc::new(if core == CoreName::Simavr { image.undecoded() } else { image }))
}
