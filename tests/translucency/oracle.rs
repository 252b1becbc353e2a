//! Views in f64, and what a pixel may see.
//!
//! A rasterizer that snaps vertices to 1/256 pixel moves each by at most [`SNAP`], and with it every point
//! inside a triangle by at most that. So a triangle whose every edge is farther than that from a pixel's
//! centre either covers it for certain or does not, and its depth there is that of the true triangle to
//! within the change of depth over that distance. What the oracle says of a pixel is the set of triangles
//! that may be nearest under these bounds: nearly always one.

use bitlight_reference::translucency::cube::{Aabb, Face, face_point};
use bitlight_reference::vector::{Vec3, add, cross, dot, length, normalize, scale, sub};

use crate::world::World;
use crate::{U, larger, smaller};

/// How far snapping to 1/256 pixel moves a point: half a step each way, and 10⁻³ pixel for the rounding of
/// `f32` before it (50 pixels × 2⁻²⁴ × some tens of operations is 10⁻⁴).
pub(crate) const SNAP: f64 = std::f64::consts::SQRT_2 / 512.0 + 1e-3;

#[derive(Clone)]
enum Kind {
    /// Depth is near / distance.
    Perspective { near: f64 },
    /// Depth falls from 1 at near to 0 at far.
    Orthographic { near: f64, far: f64 },
}

/// A view: pixel (0, 0) is the upper left corner of the image, (½, ½) its first centre.
#[derive(Clone)]
pub(crate) struct View {
    pub(crate) size: [usize; 2],
    origin: Vec3,
    right: Vec3,
    up: Vec3,
    pub(crate) forward: Vec3,
    /// Half the extent of the image, at distance 1 of a perspective view.
    pub(crate) half: [f64; 2],
    kind: Kind,
}

fn corners(bounds: &Aabb) -> [Vec3; 8] {
    let pick = |corner: usize, axis: usize| {
        if corner >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] }
    };
    [0, 1, 2, 3, 4, 5, 6, 7].map(|corner| [0, 1, 2].map(|axis| pick(corner, axis)))
}

impl View {
    fn looking(origin: Vec3, forward: Vec3, up: Vec3, size: [usize; 2], kind: Kind) -> Self {
        let forward = normalize(forward);
        let right = normalize(cross(forward, up));
        Self { size, origin, right, up: cross(right, forward), forward, half: [1.0; 2], kind }
    }

    pub(crate) fn camera(
        eye: Vec3,
        target: Vec3,
        up: Vec3,
        fov: f64,
        size: [usize; 2],
        bounds: &Aabb,
    ) -> Self {
        let kind = Kind::Perspective { near: 1.0 };
        let mut view = Self::looking(eye, sub(target, eye), up, size, kind);
        let nearest =
            corners(bounds).map(|corner| view.ahead(corner)).into_iter().fold(f64::INFINITY, smaller);
        view.kind = Kind::Perspective { near: larger(nearest * 0.99, length(bounds.half_extents()) * 1e-3) };
        let vertical = libm::tan(fov.to_radians() / 2.0);
        view.half = [vertical * size[0] as f64 / size[1] as f64, vertical];
        view
    }

    /// The map of a point light: it just holds the box and a texel more.
    pub(crate) fn from_point(eye: Vec3, bounds: &Aabb, size: usize) -> Self {
        let kind = Kind::Perspective { near: 1.0 };
        let forward = sub(bounds.centre(), eye);
        let mut view = Self::looking(eye, forward, [0.0, 1.0, 0.0], [size; 2], kind);
        let (mut half, mut near) = ([0.0; 2], f64::INFINITY);
        for corner in corners(bounds).map(|corner| sub(corner, eye)) {
            let ahead = dot(corner, view.forward);
            near = smaller(near, ahead);
            half[0] = larger(half[0], dot(corner, view.right).abs() / ahead);
            half[1] = larger(half[1], dot(corner, view.up).abs() / ahead);
        }
        view.half = half.map(|half| half + 2.0 * half / size as f64);
        view.kind = Kind::Perspective { near: near * 0.99 };
        view
    }

    /// The map of a directional light: distance counts from two radii of the box before its centre.
    pub(crate) fn from_direction(direction: Vec3, bounds: &Aabb, size: usize) -> Self {
        let radius = length(bounds.half_extents());
        let kind = Kind::Orthographic { near: 0.5 * radius, far: 3.5 * radius };
        let origin = sub(bounds.centre(), scale(2.0 * radius, normalize(direction)));
        let mut view = Self::looking(origin, direction, [0.0, 1.0, 0.0], [size; 2], kind);
        let mut half = [0.0; 2];
        for corner in corners(bounds).map(|corner| sub(corner, bounds.centre())) {
            half[0] = larger(half[0], dot(corner, view.right).abs());
            half[1] = larger(half[1], dot(corner, view.up).abs());
        }
        view.half = half.map(|half| half + 2.0 * half / size as f64);
        view
    }

    /// An orthographic view from outside onto a face of the box, which it exactly fills.
    pub(crate) fn onto_face(face: Face, bounds: &Aabb, size: usize) -> Self {
        let half = bounds.half_extents();
        let point = |s: f64, t: f64| {
            let on_cube = face_point(face, s, t);
            add(bounds.centre(), [0, 1, 2].map(|axis| on_cube[axis] * half[axis]))
        };
        let (middle, outward) = (point(0.0, 0.0), face_point(face, 0.0, 0.0));
        let (right, up) = (sub(point(1.0, 0.0), middle), sub(point(0.0, 1.0), middle));
        let deep = 2.0 * length(sub(middle, bounds.centre()));
        Self {
            size: [size; 2],
            origin: middle,
            right: normalize(right),
            up: normalize(up),
            forward: scale(-1.0, outward),
            half: [length(right), length(up)],
            kind: Kind::Orthographic { near: -0.005 * deep, far: 1.005 * deep },
        }
    }

    /// The distance of a point ahead of the view's origin.
    pub(crate) fn ahead(&self, point: Vec3) -> f64 {
        dot(sub(point, self.origin), self.forward)
    }

    /// Where a point falls on the image.
    pub(crate) fn pixel(&self, point: Vec3) -> [f64; 2] {
        let from = sub(point, self.origin);
        let by = match self.kind {
            Kind::Perspective { .. } => self.ahead(point),
            Kind::Orthographic { .. } => 1.0,
        };
        let [x, y] = [dot(from, self.right) / self.half[0] / by, dot(from, self.up) / self.half[1] / by];
        [(x + 1.0) / 2.0 * self.size[0] as f64, (1.0 - y) / 2.0 * self.size[1] as f64]
    }

    /// The ray through a place of the image; its direction is as long as makes t the distance ahead.
    pub(crate) fn ray(&self, x: f64, y: f64) -> (Vec3, Vec3) {
        let u = (2.0 * x / self.size[0] as f64 - 1.0) * self.half[0];
        let v = (1.0 - 2.0 * y / self.size[1] as f64) * self.half[1];
        let across = add(scale(u, self.right), scale(v, self.up));
        match self.kind {
            Kind::Perspective { .. } => (self.origin, add(self.forward, across)),
            Kind::Orthographic { .. } => (add(self.origin, across), self.forward),
        }
    }

    /// The distance of a point from a light: radial from a point, along the direction otherwise.
    pub(crate) fn distance(&self, point: Vec3) -> f64 {
        match self.kind {
            Kind::Perspective { .. } => length(sub(point, self.origin)),
            Kind::Orthographic { .. } => self.ahead(point),
        }
    }

    /// The larger side of a texel at a point.
    pub(crate) fn texel_size(&self, point: Vec3) -> f64 {
        let side = 2.0 * larger(self.half[0], self.half[1]) / self.size[0] as f64;
        match self.kind {
            Kind::Perspective { .. } => side * self.ahead(point),
            Kind::Orthographic { .. } => side,
        }
    }

    /// The rasterized depth of a distance ahead.
    pub(crate) fn depth(&self, ahead: f64) -> f64 {
        match self.kind {
            Kind::Perspective { near } => near / ahead,
            Kind::Orthographic { near, far } => (far - ahead) / (far - near),
        }
    }

    /// The distance from the light of a depth at a place of the image, and its change with depth.
    pub(crate) fn distance_of(&self, depth: f64, x: f64, y: f64) -> (f64, f64) {
        match self.kind {
            Kind::Perspective { near } => {
                let distance = near / depth * length(self.ray(x, y).1);
                (distance, distance / depth)
            }
            Kind::Orthographic { near, far } => (far - depth * (far - near), far - near),
        }
    }

    /// How far in pixels the rounding of `f32` may move a point near `point`: its clip coordinates are sums
    /// of four terms, each with a relative error of some [`U`], of the size of the coordinates in half
    /// images.
    pub(crate) fn rounding(&self, point: Vec3) -> f64 {
        let by = match self.kind {
            Kind::Perspective { .. } => self.ahead(point),
            Kind::Orthographic { .. } => 1.0,
        };
        let terms = (length(point) + length(self.origin)) / (smaller(self.half[0], self.half[1]) * by);
        4.0 * U * (1.0 + terms) * larger(self.size[0] as f64, self.size[1] as f64)
    }
}

/// a + b x + c y.
#[derive(Clone, Copy)]
struct Affine([f64; 3]);

impl Affine {
    fn of(f: impl Fn(f64, f64) -> f64) -> Self {
        let at = f(0.0, 0.0);
        Self([at, f(1.0, 0.0) - at, f(0.0, 1.0) - at])
    }

    fn at(self, x: f64, y: f64) -> f64 {
        self.0[0] + self.0[1] * x + self.0[2] * y
    }

    fn slope(self) -> f64 {
        (self.0[1] * self.0[1] + self.0[2] * self.0[2]).sqrt()
    }
}

/// A triangle on the image.
struct Flat {
    /// Opposite each corner: the corner's share times their sum, whose sign is that of the side seen.
    edges: [Affine; 3],
    depth: Affine,
    /// The error of a depth beyond that of snapping.
    rounding: f64,
}

/// A triangle that may cover a pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) triangle: usize,
    pub(crate) depth: f64,
    /// How far the rasterized depth may be from `depth`.
    pub(crate) slack: f64,
    /// Whether it covers the pixel for certain.
    sure: bool,
}

/// What a pixel may see.
pub(crate) struct Seen {
    pub(crate) nearest: Vec<Candidate>,
    /// Whether it may see nothing.
    pub(crate) none: bool,
}

impl Seen {
    /// Whether there is but one answer.
    pub(crate) fn clear(&self) -> bool {
        self.nearest.len() + usize::from(self.none) == 1
    }
}

/// All triangles on one view's image.
pub(crate) struct Drawn<'a> {
    view: &'a View,
    world: &'a World,
    flat: Vec<Option<Flat>>,
    band: f64,
}

impl<'a> Drawn<'a> {
    pub(crate) fn new(world: &'a World, view: &'a View) -> Self {
        Self::with_band(world, view, SNAP)
    }

    /// `band` is how far in pixels a point of a triangle may be moved.
    pub(crate) fn with_band(world: &'a World, view: &'a View, band: f64) -> Self {
        let flat = world.triangles.iter().map(|triangle| flatten(view, triangle)).collect();
        Self { view, world, flat, band }
    }

    /// The triangles that may cover a place, and how far inside it is.
    fn candidates(&self, x: f64, y: f64) -> Vec<Candidate> {
        let mut found = Vec::new();
        for (triangle, flat) in self.flat.iter().enumerate() {
            let Some(flat) = flat else { continue };
            let values = flat.edges.map(|edge| edge.at(x, y));
            let side = if values[0] + values[1] + values[2] < 0.0 { -1.0 } else { 1.0 };
            let inside = [0, 1, 2].map(|i| side * values[i] / flat.edges[i].slope());
            let least = smaller(smaller(inside[0], inside[1]), inside[2]);
            let depth = flat.depth.at(x, y);
            if least >= -self.band && depth > 0.0 {
                let slack = flat.depth.slope() * self.band + flat.rounding;
                found.push(Candidate { triangle, depth, slack, sure: least > self.band });
            }
        }
        found
    }

    /// What the pixel whose centre is (`x`, `y`) may see: of all, or of what is `behind` a depth and is none
    /// of the triangles `but`.
    pub(crate) fn seen(&self, x: f64, y: f64, behind: Option<(f64, &[usize])>) -> Seen {
        let mut nearest = self.candidates(x, y);
        let mut front = f64::NEG_INFINITY;
        if let Some((limit, but)) = behind {
            nearest.retain(|one| !but.contains(&one.triangle) && one.depth - one.slack < limit);
            nearest.iter_mut().for_each(|one| one.sure &= one.depth + one.slack < limit);
        }
        for one in nearest.iter().filter(|one| one.sure) {
            front = larger(front, one.depth - one.slack);
        }
        nearest.retain(|one| one.depth + one.slack >= front);
        Seen { nearest, none: front == f64::NEG_INFINITY }
    }

    /// Whether rays close around a pixel's centre miss: only there may a pixel without a sure triangle be
    /// empty.
    pub(crate) fn on_rim(&self, x: f64, y: f64) -> bool {
        (0..8).any(|step| {
            let angle = f64::from(step) * std::f64::consts::FRAC_PI_4;
            let (x, y) = (x + libm::cos(angle) / 128.0, y + libm::sin(angle) / 128.0);
            let (origin, direction) = self.view.ray(x, y);
            let (low, high) = (1e-9, f64::INFINITY);
            bitlight_reference::geometry::nearest_hit(origin, direction, &self.world.triangles, low, high)
                .is_none()
        })
    }

    /// The shares of a triangle's corners at a place of the image, their sum 1; where `held`, held to ≥ 0, as
    /// a pixel's that lies just outside the true triangle.
    pub(crate) fn shares(&self, triangle: usize, x: f64, y: f64, held: bool) -> [f64; 3] {
        let flat = self.flat[triangle].as_ref().unwrap();
        let values = flat.edges.map(|edge| edge.at(x, y));
        let total = values[0] + values[1] + values[2];
        let mut shares = values.map(|value| value / total);
        if held {
            shares = shares.map(|share| larger(share, 0.0));
            let total = shares[0] + shares[1] + shares[2];
            shares = shares.map(|share| share / total);
        }
        shares
    }

    /// The point and unit normal of a triangle at a place of the image, by its [`Self::shares`].
    pub(crate) fn surface(&self, triangle: usize, x: f64, y: f64, held: bool) -> (Vec3, Vec3) {
        let shares = self.shares(triangle, x, y, held);
        let blend = |of: &[Vec3; 3]| {
            add(add(scale(shares[0], of[0]), scale(shares[1], of[1])), scale(shares[2], of[2]))
        };
        (blend(&self.world.triangles[triangle]), normalize(blend(&self.world.normals[triangle])))
    }

    /// How much each value of a function of the surface may change by the rounding of `f32`, which moves the
    /// place on the triangle by [`View::rounding`]: first-order.
    pub(crate) fn spread<const N: usize>(
        &self,
        triangle: usize,
        x: f64,
        y: f64,
        f: impl Fn(Vec3, Vec3) -> [f64; N],
    ) -> [f64; N] {
        let step = 1e-3;
        let at = |x: f64, y: f64| {
            let (point, normal) = self.surface(triangle, x, y, false);
            f(point, normal)
        };
        let (here, across, down) = (at(x, y), at(x + step, y), at(x, y + step));
        let moved = self.view.rounding(self.surface(triangle, x, y, true).0) / step;
        std::array::from_fn(|i| ((across[i] - here[i]).abs() + (down[i] - here[i]).abs()) * moved)
    }
}

fn flatten(view: &View, triangle: &[Vec3; 3]) -> Option<Flat> {
    let edges = [0, 1, 2].map(|i| {
        let (a, b) = (triangle[(i + 1) % 3], triangle[(i + 2) % 3]);
        Affine::of(|x, y| {
            let (origin, direction) = view.ray(x, y);
            dot(direction, cross(sub(a, origin), sub(b, origin)))
        })
    });
    let normal = cross(sub(triangle[1], triangle[0]), sub(triangle[2], triangle[0]));
    let depth = Affine::of(|x, y| {
        let (origin, direction) = view.ray(x, y);
        // Where the view is perspective this is near times 1 / t, affine on the image; else affine in t.
        view.depth(dot(sub(triangle[0], origin), normal) / dot(direction, normal))
    });
    // An edge-on triangle covers nothing, and has no depth.
    let ahead = triangle.map(|corner| view.ahead(corner));
    let in_front = matches!(view.kind, Kind::Orthographic { .. }) || ahead.iter().all(|ahead| *ahead > 1e-9);
    if !in_front {
        return Some(Flat { edges, depth, rounding: 64.0 * U });
    }
    let at = triangle.map(|corner| view.pixel(corner));
    let (a, b) = ([at[1][0] - at[0][0], at[1][1] - at[0][1]], [at[2][0] - at[0][0], at[2][1] - at[0][1]]);
    let area = (a[0] * b[1] - a[1] * b[0]).abs();
    if area < 1e-9 {
        return None;
    }
    // Slopes of depth are differences of products over the area, so a sliver's are the less exact; the
    // depth is held to that of the corners.
    let depths = ahead.map(|ahead| view.depth(ahead));
    let (low, high) = (depths.into_iter().fold(f64::INFINITY, smaller), depths.into_iter().fold(0.0, larger));
    let sliver = ((a[0] * a[0] + a[1] * a[1]) * (b[0] * b[0] + b[1] * b[1])).sqrt() / area;
    Some(Flat {
        edges,
        depth,
        rounding: smaller(16.0 * U * (1.0 + sliver) * larger(high, 0.1), high - low) + 16.0 * U,
    })
}
