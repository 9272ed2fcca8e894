//! The furniture of the cameras: decisions of users, and its way from one scene to another.

use lookdown_tracking::furniture::Furniture;

use super::Counter;
use crate::definition::CameraDefinition;

impl Counter {
    /// Returns the furniture of a camera.
    pub(crate) fn furniture(&self, camera: &str) -> Option<&Furniture> {
        self.scene_of(camera)?.furniture(camera)
    }

    /// Changes the furniture of a camera, which is stored with the next transaction. Returns what
    /// `change` returns; `None` for a camera that is not followed.
    pub(crate) fn change_furniture(
        &mut self,
        camera: &str,
        change: impl FnOnce(&mut Furniture) -> bool,
    ) -> Option<bool> {
        let owner = self.owners.get(camera)?.clone();
        let changed = change(self.scenes.get_mut(&owner)?.furniture_mut(camera)?);
        self.changed.insert(owner);
        (self.has_news, self.is_urgent) = (true, true);
        Some(changed)
    }

    /// Returns the furniture of a camera for frames of this definition: none if their size differs.
    pub(super) fn furniture_for(
        &self,
        camera: &str,
        definition: &CameraDefinition,
    ) -> Option<Furniture> {
        let known = self.definition(camera)?;
        let has_frames = known.has_frames_of(definition);
        Some(self.furniture(camera).filter(|_| has_frames)?.clone())
    }

    /// Puts furniture of another scene into that of the camera now.
    pub(super) fn restore_furniture(&mut self, camera: &str, furniture: Option<Furniture>) {
        let owner = self.owners.get(camera);
        let scene = owner.and_then(|owner| self.scenes.get_mut(owner));
        let place = scene.and_then(|scene| scene.furniture_mut(camera));
        if let (Some(place), Some(furniture)) = (place, furniture) {
            *place = furniture;
        }
    }
}

#[cfg(test)]
mod tests;
