//! A shear building: `m_i·ẍ_i + f_i − f_{i+1} = F_i`, `f_i = c_i·(ẋ_i − ẋ_{i−1}) + k_i·(x_i − x_{i−1})`.
//!
//! Story 1 stands on the ground; `k_i` and `c_i` belong to the columns below floor `i`.

use crate::config::RigConfig;
use crate::error::{Error, Result};

/// Masses and columns, from the ground up.
#[derive(Debug, Clone)]
pub(crate) struct ShearBuilding {
    stories: Vec<Story>,
}

#[derive(Debug, Clone, Copy)]
struct Story {
    mass: f64,
    damping: f64,
    stiffness: f64,
}

impl ShearBuilding {
    /// The true building of a rig.
    ///
    /// # Errors
    /// A structure of another kind.
    pub(crate) fn new(rig: &RigConfig) -> Result<Self> {
        let Some(stories) = &rig.plant().structure.stories else {
            let allowed = "must be \"shear_building\", with `structure.stories`, for several actuators";
            return Err(Error::value("structure.kind", "another kind", allowed));
        };
        let columns = stories.dampings.iter().zip(&stories.stiffnesses);
        let stories = stories.masses.iter().zip(columns);
        Ok(Self {
            stories: stories
                .map(|(&mass, (&damping, &stiffness))| Story { mass, damping, stiffness })
                .collect(),
        })
    }

    /// Number of stories.
    pub(crate) fn len(&self) -> usize {
        self.stories.len()
    }

    /// Accelerations (m/s²) under a force (N) on each floor, from displacements (m) and velocities (m/s): one pass
    /// from the roof down.
    pub(crate) fn accelerations(
        &self,
        force: impl Fn(usize) -> f64,
        motion: impl Fn(usize) -> (f64, f64),
        mut put: impl FnMut(usize, f64),
    ) {
        let mut from_above = 0.0;
        for (i, story) in self.stories.iter().enumerate().rev() {
            let (x, v) = motion(i);
            let (x_below, v_below) = if i == 0 { (0.0, 0.0) } else { motion(i - 1) };
            let columns = story.damping * (v - v_below) + story.stiffness * (x - x_below);
            put(i, (force(i) + from_above - columns) / story.mass);
            from_above = columns;
        }
    }

    /// Power (W) lost in the columns, from the floors' velocities (m/s).
    pub(crate) fn damping_loss(&self, velocity: impl Fn(usize) -> f64) -> f64 {
        self.across(velocity).map(|(story, drift)| story.damping * drift * drift).sum()
    }

    /// Energy (J) of the masses and the columns, from displacements (m) and velocities (m/s).
    pub(crate) fn stored(&self, motion: impl Fn(usize) -> (f64, f64)) -> f64 {
        let kinetic = self.stories.iter().enumerate().map(|(i, story)| story.mass * motion(i).1.powi(2));
        let elastic = self.across(|i| motion(i).0).map(|(story, drift)| story.stiffness * drift * drift);
        0.5 * (kinetic.sum::<f64>() + elastic.sum::<f64>())
    }

    /// Each story with what the floor above its columns has more than the one below.
    fn across(&self, value: impl Fn(usize) -> f64) -> impl Iterator<Item = (&Story, f64)> {
        let drift = move |i: usize| value(i) - if i == 0 { 0.0 } else { value(i - 1) };
        self.stories.iter().enumerate().map(move |(i, story)| (story, drift(i)))
    }

    /// No mode is faster than this (rad/s): Gershgorin's circles.
    pub(crate) fn fastest_rate(&self) -> f64 {
        let above = |i: usize| self.stories.get(i + 1).copied();
        let bound = |(i, story): (usize, &Story)| {
            let (k, c) = above(i).map_or((0.0, 0.0), |s| (s.stiffness, s.damping));
            let elastic = (2.0 * (story.stiffness + k) / story.mass).sqrt();
            elastic.max(2.0 * (story.damping + c) / story.mass)
        };
        self.stories.iter().enumerate().map(bound).fold(0.0, f64::max)
    }
}
