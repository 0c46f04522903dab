//! Chain of driven joints in a URDF's tree, with the bodies on each of them, at q = 0.

use didim_dynamics::MAX_JOINTS;
use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::element::is_whole_degrees;
use super::error::UrdfError;
use super::file::{
    Body, CollisionCapsule, FileJoint, FileLimit, Inertial, JointType, Link, UrdfFile,
};
use super::limits::UrdfLimits;
use super::note::UrdfNote;
use super::shape::UrdfShape;

/// A driven joint of the chain, in the frame of the base at q = 0.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ChainAxis {
    pub(super) name: String,
    /// Name of the link that it moves.
    pub(super) link_name: String,
    pub(super) is_prismatic: bool,
    /// A point on the axis.
    pub(super) point_on_axis: Vector3<f64>,
    /// Unit vector.
    pub(super) direction: Vector3<f64>,
    /// \[rad or m\]
    pub(super) position: [f64; 2],
    /// Limit of the file, if any \[rad/s or m/s\].
    pub(super) velocity: Option<f64>,
    /// Limit of the file, if any \[N·m or N\].
    pub(super) effort: Option<f64>,
    /// Viscous and Coulomb friction, if the file has them.
    pub(super) friction: Option<[f64; 2]>,
    /// Frame of the link that it moves, at q = 0.
    pub(super) pose: IsometryMatrix3<f64>,
    /// Angle between it and the axis before that is printed with too few digits, if any.
    pub(super) rough_angle: Option<String>,
    /// Links up to the next axis, first the link that it moves.
    pub(super) attached_links: Vec<AttachedLink>,
}

/// A link that moves with an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct AttachedLink {
    /// Its index in the file.
    pub(super) link: usize,
    pub(super) name: String,
    /// Its frame in that of the base at q = 0.
    pub(super) pose: IsometryMatrix3<f64>,
    /// Its body in the frame of the base at q = 0, if it has one.
    pub(super) body: Option<Body>,
    /// True if a joint outside the chain leads to it.
    pub(super) is_off_chain: bool,
    /// Capsules about its collision shapes, likewise.
    pub(super) capsules: Vec<CollisionCapsule>,
}

impl ChainAxis {
    /// Returns the bodies between this axis and the next one.
    pub(super) fn link_bodies(&self) -> impl Iterator<Item = &Body> {
        self.attached_links.iter().filter_map(|attached| attached.body.as_ref())
    }
}

pub(super) struct Chain {
    pub(super) base: String,
    pub(super) tip: String,
    pub(super) axes: Vec<ChainAxis>,
    /// The tip's frame in that of the base at q = 0.
    pub(super) tip_pose: IsometryMatrix3<f64>,
    /// Upward direction in the frame of the base: z of the root, all joints at 0.
    pub(super) up_direction: Vector3<f64>,
    /// True if every body is known.
    pub(super) has_bodies: bool,
    /// Capsules about the collision shapes of fixed links below the first axis, in the frame of the
    /// base.
    pub(super) base_capsules: Vec<CollisionCapsule>,
    /// Shapes of all links, in the frame of the base at q = 0.
    pub(super) shapes: Vec<UrdfShape>,
    /// Links with shapes that cannot be read, and the number of the axis that moves each.
    pub(super) unread_shapes: Vec<(String, usize)>,
    pub(super) notes: Vec<UrdfNote>,
}

impl FileJoint {
    fn is_moving(&self) -> bool {
        self.kind != JointType::Fixed
    }

    /// Returns its range \[rad or m\]. Exporters write 0 to 0 for a range that nobody gave.
    fn range(&self, limit: &FileLimit, notes: &mut Vec<UrdfNote>) -> [f64; 2] {
        let name = self.name.clone();
        let free = UrdfLimits::DEFAULT.continuous_range_rad;
        let range = [limit.lower, limit.upper];
        let is_degrees =
            |end: &f64| is_whole_degrees(*end, UrdfLimits::DEFAULT.whole_degrees_limit_rad);
        match self.kind {
            JointType::Continuous => {
                notes.push(UrdfNote::Continuous { joint: name });
                [-free, free]
            }
            JointType::Revolute if range.iter().all(|limit| limit.abs() == 0.0) => {
                notes.push(UrdfNote::OpenRange { joint: name });
                [-free, free]
            }
            JointType::Revolute if range.iter().any(is_degrees) => {
                notes.push(UrdfNote::LimitsInDegrees { joint: name, range });
                range
            }
            _ => range,
        }
    }
}

impl UrdfFile {
    /// Returns the chain from base to tip; a name selects each of them if it is given.
    pub(super) fn chain(&self, base: Option<&str>, tip: Option<&str>) -> Result<Chain, UrdfError> {
        self.check_tree()?;
        let base = match base {
            Some(name) => self.link("base", name)?,
            None => self.find_root()?,
        };
        let tip = match tip {
            Some(name) => self.link("tip", name)?,
            None => self.only_tip(base)?,
        };
        let name = |link: usize| self.links[link].name.clone();
        let Some(path_between) = self.route(base, tip) else {
            return Err(UrdfError::NotConnected { base: name(base), tip: name(tip) });
        };
        let moving: Vec<usize> =
            path_between.iter().copied().filter(|k| self.joints[*k].is_moving()).collect();
        if !(1..=MAX_JOINTS).contains(&moving.len()) {
            let (found, largest) = (moving.len(), MAX_JOINTS);
            return Err(UrdfError::Joints { found, base: name(base), tip: name(tip), largest });
        }
        let mut root = base;
        while let Some(joint) = self.joints.iter().find(|joint| joint.child == root) {
            root = joint.parent;
        }
        let standing = self.poses(root)[base].unwrap_or_else(IsometryMatrix3::identity);
        let poses = self.poses(base);
        let mut chain = Chain {
            base: name(base),
            tip: name(tip),
            axes: Vec::new(),
            tip_pose: poses[tip].unwrap_or_else(IsometryMatrix3::identity),
            up_direction: standing.rotation.inverse() * Vector3::z(),
            has_bodies: true,
            base_capsules: Vec::new(),
            shapes: Vec::new(),
            unread_shapes: Vec::new(),
            notes: self.notes.clone(),
        };
        self.collect_stand(base, &moving, &poses, &mut chain);
        let mut rough_angle = None;
        for &k in &path_between {
            let joint = &self.joints[k];
            if let Some(text) = joint.angle_in_degrees.clone() {
                let (joint, line) = (joint.name.clone(), joint.line);
                return Err(UrdfError::Degrees { joint, text, line });
            }
            rough_angle = joint.rough_angle.clone().or(rough_angle);
            if !joint.is_moving() {
                continue;
            }
            // The axis is given in the joint's frame, which is that of its child at q = 0.
            let pose = poses[joint.child].unwrap_or_else(IsometryMatrix3::identity);
            let mut axis = axis_of(joint, &pose, &mut chain.notes)?;
            axis.link_name = name(joint.child);
            axis.rough_angle = rough_angle.take();
            self.attach_fixed_links((joint.child, false), &moving, &poses, &mut axis, &mut chain);
            chain.axes.push(axis);
        }
        Ok(chain)
    }

    /// Collects the shapes of a fixed link and of all links on it.
    fn collect_stand(
        &self,
        link: usize,
        moving: &[usize],
        poses: &[Option<IsometryMatrix3<f64>>],
        chain: &mut Chain,
    ) {
        let capsules = self.link_capsules((link, false), poses, chain);
        chain.base_capsules.extend(capsules);
        for (k, joint) in self.joints.iter().enumerate() {
            if joint.parent == link && !moving.contains(&k) {
                self.collect_stand(joint.child, moving, poses, chain);
            }
        }
    }

    /// Returns the capsules of a link in the frame of the base, and collects its shapes. Names the
    /// link if some are not read.
    fn link_capsules(
        &self,
        (link, is_moved): (usize, bool),
        poses: &[Option<IsometryMatrix3<f64>>],
        chain: &mut Chain,
    ) -> Vec<CollisionCapsule> {
        let Link { name, capsules, shapes, .. } = &self.links[link];
        // The axis that moves the link is added to the chain after its links.
        let number = chain.axes.len() + usize::from(is_moved);
        if shapes.iter().any(Option::is_none) {
            chain.unread_shapes.push((name.clone(), number));
        }
        let pose = poses[link].unwrap_or_else(IsometryMatrix3::identity);
        let shapes = shapes.iter().flatten().map(|shape| UrdfShape {
            link: name.clone(),
            number,
            geometry: shape.geometry.clone(),
            pose: pose * shape.pose,
        });
        chain.shapes.extend(shapes);
        capsules.iter().map(|capsule| capsule.seen_from(&pose)).collect()
    }

    /// Collects the links that move with a link, up to the next joints of the chain.
    fn attach_fixed_links(
        &self,
        (link, is_held): (usize, bool),
        moving: &[usize],
        poses: &[Option<IsometryMatrix3<f64>>],
        axis: &mut ChainAxis,
        chain: &mut Chain,
    ) {
        let Link { name, body, body_angle_in_degrees, .. } = &self.links[link];
        if let Some(text) = body_angle_in_degrees.clone() {
            chain.notes.push(UrdfNote::BodyInDegrees { link: name.clone(), text });
        }
        let body = match (body, &poses[link]) {
            (Inertial::Body(body), Some(pose)) => Some(body.seen_from(pose)),
            (Inertial::Impossible(problem), _) => {
                chain.has_bodies = false;
                let (link, problem) = (name.clone(), problem.clone());
                chain.notes.push(UrdfNote::ImpossibleBody { link, problem });
                None
            }
            _ => None,
        };
        let capsules = self.link_capsules((link, true), poses, chain);
        axis.attached_links.push(AttachedLink {
            link,
            name: name.clone(),
            pose: poses[link].unwrap_or_else(IsometryMatrix3::identity),
            body,
            is_off_chain: is_held,
            capsules,
        });
        for (k, joint) in self.joints.iter().enumerate() {
            if joint.parent == link && !moving.contains(&k) {
                if joint.is_moving() {
                    chain.notes.push(UrdfNote::HeldStill { joint: joint.name.clone() });
                }
                let child = (joint.child, is_held || joint.is_moving());
                self.attach_fixed_links(child, moving, poses, axis, chain);
            }
        }
        // Only a driven link gets a note, and only if no link on its axis has a body.
        if axis.link_bodies().next().is_none()
            && moving.iter().any(|k| self.joints[*k].child == link)
        {
            let unknown = chain.notes.iter().any(|note| note.is_of_link(name));
            if !unknown {
                chain.has_bodies = false;
                chain.notes.push(UrdfNote::NoBody { link: name.clone() });
            }
        }
    }

    /// Checks that at most one joint leads to a link, and none back.
    fn check_tree(&self) -> Result<(), UrdfError> {
        // Parent of each link.
        let mut parents: Vec<Option<usize>> = vec![None; self.links.len()];
        for joint in &self.joints {
            let again = parents[joint.child].replace(joint.parent).is_some();
            // The path from a link towards the base ends at a root, or in a loop.
            let mut above = Some(joint.parent);
            while let Some(link) = above.filter(|link| *link != joint.child) {
                above = parents[link];
            }
            if again || above.is_some() {
                let (line, link) = (joint.line, self.links[joint.child].name.clone());
                return Err(UrdfError::Loop { joint: joint.name.clone(), link, line });
            }
        }
        Ok(())
    }

    fn link(&self, end: &'static str, name: &str) -> Result<usize, UrdfError> {
        let found_link = self.links.iter().position(|link| link.name == name);
        let (link, available) = (name.to_owned(), self.links_text());
        found_link.ok_or(UrdfError::NoSuchEnd { end, link, available })
    }

    fn find_root(&self) -> Result<usize, UrdfError> {
        let is_root = |link: &usize| self.joints.iter().all(|joint| joint.child != *link);
        let roots: Vec<usize> = (0..self.links.len()).filter(is_root).collect();
        match roots[..] {
            [root] => Ok(root),
            _ => Err(UrdfError::Bases { roots: self.names(&roots) }),
        }
    }

    fn names(&self, links: &[usize]) -> String {
        links.iter().map(|link| self.links[*link].name.as_str()).collect::<Vec<_>>().join(" ")
    }

    /// Returns the joints from one link to a descendant.
    fn route(&self, base: usize, tip: usize) -> Option<Vec<usize>> {
        let (mut path_between, mut at) = (Vec::new(), tip);
        while at != base {
            let up = self.joints.iter().position(|joint| joint.child == at)?;
            path_between.push(up);
            at = self.joints[up].parent;
        }
        path_between.reverse();
        Some(path_between)
    }

    /// Finds the end of the arm, if all leaves hang on one chain of moving joints or on a part of
    /// it.
    fn only_tip(&self, base: usize) -> Result<usize, UrdfError> {
        let is_leaf = |link: &usize| self.joints.iter().all(|joint| joint.parent != *link);
        let moving = |path_between: Vec<usize>| -> Vec<usize> {
            path_between.into_iter().filter(|k| self.joints[*k].is_moving()).collect()
        };
        let leaves: Vec<(usize, Vec<usize>)> = (0..self.links.len())
            .filter(is_leaf)
            .filter_map(|leaf| Some((leaf, moving(self.route(base, leaf)?))))
            .collect();
        let longest = leaves.iter().max_by_key(|(_, route)| route.len());
        let Some((_, chain)) = longest else { return Ok(base) };
        if leaves.iter().any(|(_, route)| !chain.starts_with(route)) {
            let is_end = |route: &Vec<usize>| {
                leaves.iter().all(|(_, other)| other == route || !other.starts_with(route))
            };
            let ends = leaves.iter().filter(|(_, route)| is_end(route)).map(|(leaf, _)| *leaf);
            return Err(self.several_tips(base, &ends.collect::<Vec<_>>()));
        }
        // If the last link has several frames, the first in the file counts.
        let mut on_the_last = leaves.iter().filter(|(_, route)| route == chain);
        Ok(on_the_last.next().map_or(base, |(leaf, _)| *leaf))
    }

    /// Returns the error on several ends: the links before their forks, as before the fingers of a
    /// gripper, and the ends to which driven joints lead.
    fn several_tips(&self, base: usize, ends: &[usize]) -> UrdfError {
        let route = |link: usize| self.route(base, link).unwrap_or_default();
        let routes: Vec<Vec<usize>> = ends.iter().map(|end| route(*end)).collect();
        let mut forks: Vec<usize> = Vec::new();
        for (k, own) in routes.iter().enumerate() {
            let others = routes.iter().enumerate().filter(|(other, _)| *other != k);
            let length = others.map(|(_, other)| common_length(own, other)).max().unwrap_or(0);
            let common = own.get(..length).unwrap_or_default();
            let fork = common.last().map_or(base, |joint| self.joints[*joint].child);
            let has_drive = common.iter().any(|joint| self.joints[*joint].is_moving());
            if has_drive && !forks.contains(&fork) {
                forks.push(fork);
            }
        }
        let is_driven = |end: &&usize| {
            route(**end).iter().all(|joint| {
                let FileJoint { kind, mimicked_joint, .. } = &self.joints[*joint];
                mimicked_joint.is_none() && !matches!(kind, JointType::Floating | JointType::Planar)
            })
        };
        let ends: Vec<usize> = ends.iter().filter(is_driven).copied().collect();
        UrdfError::Tips { forks: self.names(&forks), tips: self.names(&ends) }
    }

    /// Returns the frame of each link below the base in that of the base, all joints at 0.
    fn poses(&self, base: usize) -> Vec<Option<IsometryMatrix3<f64>>> {
        let mut poses = vec![None; self.links.len()];
        poses[base] = Some(IsometryMatrix3::identity());
        // Each pass places at least one more joint.
        for _ in &self.joints {
            for joint in &self.joints {
                if let (Some(parent), None) = (poses[joint.parent], poses[joint.child]) {
                    poses[joint.child] = Some(parent * joint.origin);
                }
            }
        }
        poses
    }
}

/// Returns the number of equal joints at the beginning of two routes.
fn common_length(one: &[usize], other: &[usize]) -> usize {
    one.iter().zip(other).take_while(|(one, other)| one == other).count()
}

fn axis_of(
    joint: &FileJoint,
    pose: &IsometryMatrix3<f64>,
    notes: &mut Vec<UrdfNote>,
) -> Result<ChainAxis, UrdfError> {
    let (name, line) = (joint.name.clone(), joint.line);
    if let Some(of) = &joint.mimicked_joint {
        return Err(UrdfError::Mimic { joint: name, of: of.clone(), line });
    }
    let kind = match joint.kind {
        JointType::Floating => Some("floating"),
        JointType::Planar => Some("planar"),
        _ => None,
    };
    if let Some(kind) = kind {
        return Err(UrdfError::Kind { joint: name, kind, line });
    }
    let wrong = |problem: String| UrdfError::Limit { joint: joint.name.clone(), problem, line };
    let limit = joint.limit.ok_or_else(|| wrong("no limits".to_owned()))?;
    // URDFs have 0 for an unknown limit.
    let mut limit_of = |value: f64, what: &'static str| match value {
        0.0 => {
            notes.push(UrdfNote::OpenLimit { joint: name.clone(), what });
            Ok(None)
        }
        _ if value < 0.0 => Err(wrong(format!("{what} below 0"))),
        _ => Ok(Some(value)),
    };
    let velocity = limit_of(limit.velocity, "velocity")?;
    let effort = limit_of(limit.effort, "effort")?;
    let position = joint.range(&limit, notes);
    if let Some((largest, text)) = joint.cleaned_axis.clone() {
        notes.push(UrdfNote::CleanedAxis { joint: name.clone(), text, largest });
    }
    if position[0] >= position[1] {
        return Err(wrong(format!("a range from {} to {}", position[0], position[1])));
    }
    Ok(ChainAxis {
        name,
        link_name: String::new(),
        is_prismatic: joint.kind == JointType::Prismatic,
        point_on_axis: (pose * Point3::origin()).coords,
        direction: pose.rotation * joint.axis,
        position,
        velocity,
        effort,
        friction: joint.friction,
        pose: *pose,
        rough_angle: None,
        attached_links: Vec::new(),
    })
}
