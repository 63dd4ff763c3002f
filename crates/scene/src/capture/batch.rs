//! Shading of several fragments of a triangle at a time. [`Raster`] and [`Shader`] have the
//! plain text; every number here is found by the same operations in the same order.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::Vec2;

use crate::capture::geometry::Triangle;
use crate::capture::lanes::{
    Doubles, LANES, Singles, at_least, at_most, dot_with, four, narrow, normalize_doubles,
    normalize_singles, splat_point, splat3, three,
};
use crate::capture::raster::Raster;
use crate::capture::scan::Covered;
use crate::capture::setup::STEPS;
use crate::capture::shade::{
    AMBIENT, FILL_STRENGTH, KEY_STRENGTH, LEAST_ALPHA, MOST_COLOUR, Shaded, Shader,
};
use crate::scene::{AlphaMode, Material, TextureUse};
use screendoor_trace::picture::Space;
use screendoor_trace::trace::{DepthPlane, Fragment, SampleMask, Unorm32};

/// Fragments of a piece of a triangle, put together until there is one for each lane.
pub(super) struct Batch<'p> {
    raster: &'p Raster<'p>,
    shader: &'p Shader<'p>,
    triangle: &'p Triangle,
    /// What weights change by per pixel to the right and downwards, before perspective, each
    /// corner's and their sum.
    steps: [([f64; 3], f64); 2],
    /// The depth's slopes, where they can be recorded.
    slopes: Option<[i32; 2]>,
    len: usize,
    hits: &'p mut Hits,
}

/// What is known of fragments before they are shaded.
#[derive(Default)]
pub(super) struct Hits {
    pixels: [[u16; LANES]; 2],
    coverage: [SampleMask; LANES],
    /// Where to shade, from the pixel's centre.
    aside: [[i64; 2]; LANES],
    /// The edges there, without what breaks ties.
    values: [[f64; LANES]; 3],
}

/// The weights of the triangle's vertices at each fragment, and what they change by over a pixel.
struct Weights<S: Simd> {
    at: [Doubles<S>; 3],
    /// Of the second and the third vertex alone, to the right and downwards.
    changes: [[Singles<S>; 2]; 2],
}

/// What shading finds of fragments.
struct Lit<S: Simd> {
    colour: [Singles<S>; 3],
    /// What of that is the key light's, where it is asked for.
    direct: Option<[Singles<S>; 3]>,
    alpha: Singles<S>,
    /// A bit for each fragment that there is.
    kept: u64,
}

/// Two vectors, each by a number.
#[inline(always)]
fn combined<S: Simd>((x, y): (Vec2, Vec2), by: [Singles<S>; 2]) -> [Singles<S>; 2] {
    [by[0] * x.x + by[1] * y.x, by[0] * x.y + by[1] * y.y]
}

impl<'p> Batch<'p> {
    #[inline(always)]
    pub(super) fn new(
        raster: &'p Raster<'p>,
        triangle: &'p Triangle,
        shader: &'p Shader<'p>,
        hits: &'p mut Hits,
    ) -> Self {
        let t = raster.triangle;
        let step = STEPS as f64 / t.area as f64;
        let scaled = |slope: fn(&[i64; 2]) -> f64| {
            let of =
                |i: usize| slope(&[raster.edges[i].a, raster.edges[i].b]) * step * t.inverse_w[i];
            let scaled = [of(0), of(1), of(2)];
            (scaled, scaled[0] + scaled[1] + scaled[2])
        };
        Batch {
            raster,
            shader,
            triangle,
            steps: [scaled(|e| e[0] as f64), scaled(|e| e[1] as f64)],
            slopes: raster.recorded_slopes(),
            len: 0,
            hits,
        }
    }

    /// Adds what is covered of a pixel in row `y`.
    #[inline(always)]
    pub(super) fn add<S: Simd>(
        &mut self,
        simd: S,
        y: i64,
        covered: Covered,
        fragments: &mut Vec<Fragment>,
    ) {
        let Covered { x, coverage, values } = covered;
        let holds_centre = values[0] | values[1] | values[2] >= 0;
        let aside = match holds_centre {
            true => [0, 0],
            false => self.raster.samples.nearest_in(simd, coverage),
        };
        let i = self.len % LANES;
        for (k, edge) in self.raster.edges.iter().enumerate() {
            let there = values[k] + edge.lowered + edge.a * aside[0] + edge.b * aside[1];
            self.hits.values[k][i] = there as f64;
        }
        self.hits.pixels[0][i] = x as u16;
        self.hits.pixels[1][i] = y as u16;
        self.hits.coverage[i] = coverage;
        self.hits.aside[i] = aside;
        self.len += 1;
        if self.len == LANES {
            self.finish(simd, fragments);
        }
    }

    /// Shades what has come together.
    #[inline(always)]
    pub(super) fn finish<S: Simd>(&mut self, simd: S, fragments: &mut Vec<Fragment>) {
        if self.len == 0 {
            return;
        }
        let this = &*self;
        simd.vectorize(
            #[inline(always)]
            || this.shade(simd, fragments),
        );
        self.len = 0;
    }

    #[inline(always)]
    fn shade<S: Simd>(&self, simd: S, fragments: &mut Vec<Fragment>) {
        let depths = self.depths(simd);
        let material = self.shader.material(self.triangle.material);
        let textured = material.base_texture.is_some()
            || material.alpha_texture.is_some()
            || material.transmission_texture.is_some()
            || material.emissive_texture.is_some();
        let weights = self.weights(simd, textured);
        let Lit { colour, direct, alpha, kept } = self.colours(simd, material, &weights);
        let colour: [[f32; LANES]; 3] = [colour[0].into(), colour[1].into(), colour[2].into()];
        let direct =
            direct.map(|[r, g, b]| -> [[f32; LANES]; 3] { [r.into(), g.into(), b.into()] });
        let alpha: [f32; LANES] = alpha.into();
        let [x, y] = self.hits.pixels;
        let space = self.shader.space;
        let of = Fragment {
            primitive: self.triangle.primitive,
            object: self.triangle.object,
            ..Fragment::default()
        };
        let len = self.len.min(LANES);
        fragments.reserve(LANES);
        for i in (0..len).filter(|i| kept >> i & 1 == 1) {
            let mut colour = [colour[0][i], colour[1][i], colour[2][i]];
            if space != Space::Linear {
                colour = colour.map(|c| space.of_linear(f64::from(c)) as f32);
            }
            let mut fragment = Fragment {
                x: x[i],
                y: y[i],
                coverage: self.hits.coverage[i],
                depth: depths[i],
                ..of
            };
            let direct = direct.map_or([0.0; 3], |direct| direct.map(|channel| channel[i]));
            Shaded { colour, alpha: alpha[i], direct }.put(&mut fragment);
            fragments.push(fragment);
        }
    }

    /// The depths over the pixels.
    #[inline(always)]
    fn depths<S: Simd>(&self, simd: S) -> [DepthPlane; LANES] {
        let [x0, y0] = self.raster.triangle.corners[0];
        let from = |pixel: u16, corner: i64| {
            f64::from(pixel) * STEPS as f64 + ((STEPS / 2) - corner) as f64
        };
        let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            x[i] = from(self.hits.pixels[0][i], x0);
            y[i] = from(self.hits.pixels[1][i], y0);
        }
        let [per_x, per_y] = self.raster.depth_slopes;
        let (x, y) = (Doubles::from_slice(simd, &x), Doubles::from_slice(simd, &y));
        let z = x * per_x + self.raster.triangle.depth[0] + y * per_y;
        // Halves go away from 0. What is above -1/2 becomes 0 at least.
        let whole = z.trunc();
        let up = (z - whole).simd_ge(0.5);
        let rounded = up.select(whole + 1.0, whole);
        let fits = z.simd_gt(-0.5) & rounded.simd_le(f64::from(u32::MAX));
        let fits = if self.slopes.is_some() { fits.to_bitmask() } else { 0 };
        let [dzdx, dzdy] = self.slopes.unwrap_or_default();
        let rounded: [f64; LANES] = rounded.into();
        let mut depths = [DepthPlane { z: Unorm32(0), dzdx, dzdy }; LANES];
        for i in 0..LANES {
            depths[i].z = Unorm32(rounded[i] as u32);
        }
        let all = (1 << self.len.min(LANES)) - 1;
        if fits & all != all {
            for i in (0..self.len.min(LANES)).filter(|i| fits >> i & 1 == 0) {
                let centre = [0, 1].map(|k| i64::from(self.hits.pixels[k][i]) * STEPS + STEPS / 2);
                let [x, y] = self.hits.aside[i];
                depths[i] = self.raster.depth_plane(centre, [centre[0] + x, centre[1] + y]);
            }
        }
        depths
    }

    /// The vertices' weights; what they change by only where `changes` are asked for.
    #[inline(always)]
    fn weights<S: Simd>(&self, simd: S, changes: bool) -> Weights<S> {
        let t = self.raster.triangle;
        let scaled = three(
            #[inline(always)]
            |i| Doubles::from_slice(simd, &self.hits.values[i]) / (t.area as f64) * t.inverse_w[i],
        );
        let sum = scaled[0] + scaled[1] + scaled[2];
        let values = three(
            #[inline(always)]
            |i| scaled[i] / sum,
        );
        let at = [
            self.of_vertex(simd, values, 0),
            self.of_vertex(simd, values, 1),
            self.of_vertex(simd, values, 2),
        ];
        let zero = Singles::splat(simd, 0.0);
        if !changes {
            return Weights { at, changes: [[zero; 2]; 2] };
        }
        let [right, down] = &self.steps;
        let changes = [self.change(simd, right, values, sum), self.change(simd, down, values, sum)];
        Weights { at, changes }
    }

    /// What the weights of the second and the third vertex change by over a pixel, by the
    /// quotient rule.
    #[inline(always)]
    fn change<S: Simd>(
        &self,
        simd: S,
        (step, all): &([f64; 3], f64),
        values: [Doubles<S>; 3],
        sum: Doubles<S>,
    ) -> [Singles<S>; 2] {
        let by = three(
            #[inline(always)]
            |i| (step[i] - values[i] * *all) / sum,
        );
        [narrow(self.of_vertex(simd, by, 1)), narrow(self.of_vertex(simd, by, 2))]
    }

    /// The weight of vertex `k` of the triangle, of those of the piece's corners.
    #[inline(always)]
    fn of_vertex<S: Simd>(&self, simd: S, by: [Doubles<S>; 3], k: usize) -> Doubles<S> {
        let mut sum = Doubles::splat(simd, 0.0);
        for (by, corner) in by.iter().zip(&self.raster.triangle.weights) {
            sum += *by * corner[k];
        }
        sum
    }

    /// What shading finds.
    #[inline(always)]
    fn colours<S: Simd>(&self, simd: S, material: &Material, weights: &Weights<S>) -> Lit<S> {
        let [a, b, c] = &self.triangle.vertices;
        let at = three(
            #[inline(always)]
            |i| narrow(weights.at[i]),
        );
        let (more, most) = (b.colour - a.colour, c.colour - a.colour);
        let vertex = four(
            #[inline(always)]
            |k| at[1] * more[k] + a.colour[k] + at[2] * most[k],
        );
        let mut base = four(
            #[inline(always)]
            |k| vertex[k] * material.base[k],
        );
        let mut detail_alpha = vertex[3];
        if let Some(texture) = material.base_texture {
            let texels = self.texels(simd, texture, at, weights);
            base = four(
                #[inline(always)]
                |k| base[k] * texels[k],
            );
            detail_alpha *= texels[3];
        }
        if let Some(texture) = material.alpha_texture {
            detail_alpha *= self.texels(simd, texture, at, weights)[0];
        }
        let given = self.shader.alpha;
        let mut cut = 0;
        let mut alpha = match material.alpha_mode {
            AlphaMode::Opaque => Singles::splat(simd, given.unwrap_or(1.0)),
            AlphaMode::Mask { cutoff } => {
                cut = (detail_alpha * material.base.w).simd_lt(cutoff).to_bitmask();
                Singles::splat(simd, given.unwrap_or(1.0))
            }
            AlphaMode::Blend => detail_alpha * given.unwrap_or(material.base.w),
        };
        if given.is_none() && material.transmission > 0.0 {
            let tint = (base[0] + base[1] + base[2]) / 3.0;
            let tint = tint.simd_lt(0.0).select(Singles::splat(simd, 0.0), tint);
            let tint = tint.simd_gt(1.0).select(Singles::splat(simd, 1.0), tint);
            let share = match material.transmission_texture {
                Some(of) => self.texels(simd, of, at, weights)[0],
                None => Singles::splat(simd, 1.0),
            };
            let through = share * material.transmission.clamp(0.0, 1.0);
            alpha *= 1.0 - through * tint;
        }
        let varies = self.shader.opacity.varies();
        let seen = (varies || !material.unlit).then(
            #[inline(always)]
            || self.seen(simd, weights.at, at),
        );
        if let Some((_, facing)) = seen.filter(|_| varies) {
            alpha = self.varied(simd, alpha, facing);
        }
        let kept = alpha.simd_ge(LEAST_ALPHA).to_bitmask() & !cut;
        let alpha = at_most(simd, alpha, 1.0);
        let mut colour = [base[0], base[1], base[2]];
        let mut direct = None;
        if let Some((normal, _)) = seen.filter(|_| !material.unlit) {
            let [light, key] = self.light(simd, normal);
            if self.shader.apart {
                direct = Some(three(
                    #[inline(always)]
                    |k| at_most(simd, at_least(simd, colour[k] * key, 0.0), MOST_COLOUR),
                ));
            }
            colour = three(
                #[inline(always)]
                |k| colour[k] * light,
            );
        }
        let emissive = material.emissive;
        let glow = match material.emissive_texture {
            Some(of) => {
                let [r, g, b, _] = self.texels(simd, of, at, weights);
                [r * emissive.x, g * emissive.y, b * emissive.z]
            }
            None => splat3(simd, emissive),
        };
        let colour = three(
            #[inline(always)]
            |k| at_most(simd, at_least(simd, colour[k] + glow[k], 0.0), MOST_COLOUR),
        );
        Lit { colour, direct, alpha, kept }
    }

    /// What the texture has at each fragment.
    #[inline(always)]
    fn texels<S: Simd>(
        &self,
        simd: S,
        of: TextureUse,
        at: [Singles<S>; 3],
        weights: &Weights<S>,
    ) -> [Singles<S>; 4] {
        let [a, b, c] = self.triangle.vertices.each_ref().map(|v| v.uvs[of.set]);
        // From weights to the mesh's coordinates, and from those to the texture's.
        let mesh = (b - a, c - a);
        let turn = (of.transform.matrix2.x_axis, of.transform.matrix2.y_axis);
        let [u, v] = combined(mesh, [at[1], at[2]]);
        let [u, v] = combined(turn, [u + a.x, v + a.y]);
        let moved = of.transform.translation;
        let uv = [(u + moved.x).into(), (v + moved.y).into()];
        let [dx, dy] = weights.changes;
        let ([ux, vx], [uy, vy]) =
            (combined(turn, combined(mesh, dx)), combined(turn, combined(mesh, dy)));
        let (dx, dy) = ([ux.into(), vx.into()], [uy.into(), vy.into()]);
        let texture = &self.shader.scene.textures[of.texture];
        let len = self.len;
        let mut texels = [[0.0; LANES]; 4];
        simd.vectorize(
            #[inline(always)]
            || {
                let found = texture.sample_each(&uv, &dx, &dy, len);
                for (i, texel) in found.iter().enumerate() {
                    for k in 0..4 {
                        texels[k][i] = texel[k];
                    }
                }
            },
        );
        four(
            #[inline(always)]
            |k| Singles::from_slice(simd, &texels[k]),
        )
    }

    /// Alphas by the angle at which the surface is seen, one by one: nobody else asks for powers.
    #[inline(never)]
    fn varied<S: Simd>(&self, simd: S, alpha: Singles<S>, facing: Singles<S>) -> Singles<S> {
        let (mut alphas, facing): ([f32; LANES], [f32; LANES]) = (alpha.into(), facing.into());
        for (alpha, facing) in alphas.iter_mut().zip(facing) {
            *alpha = self.shader.opacity.alpha(alpha.clamp(0.0, 1.0), facing);
        }
        Singles::from_slice(simd, &alphas)
    }

    /// [`Shader::seen`].
    #[inline(always)]
    fn seen<S: Simd>(
        &self,
        simd: S,
        weights: [Doubles<S>; 3],
        narrow_weights: [Singles<S>; 3],
    ) -> ([Singles<S>; 3], Singles<S>) {
        let [a, b, c] = &self.triangle.vertices;
        let camera = self.shader.camera;
        let w = narrow_weights;
        let normal = three(
            #[inline(always)]
            |k| w[0] * a.normal[k] + w[1] * b.normal[k] + w[2] * c.normal[k],
        );
        let towards = match camera.eye {
            None => splat3(simd, camera.back.as_vec3()),
            Some(eye) => {
                let way = three(
                    #[inline(always)]
                    |k| {
                        let point = weights[0] * a.position[k]
                            + weights[1] * b.position[k]
                            + weights[2] * c.position[k];
                        eye[k] - point
                    },
                );
                let way = normalize_doubles(simd, way, splat_point(simd, camera.back));
                three(
                    #[inline(always)]
                    |k| narrow(way[k]),
                )
            }
        };
        let normal = normalize_singles(simd, normal, towards);
        let facing = normal[0] * towards[0] + normal[1] * towards[1] + normal[2] * towards[2];
        let away = facing.simd_lt(0.0);
        let normal = three(
            #[inline(always)]
            |k| away.select(-normal[k], normal[k]),
        );
        (normal, away.select(-facing, facing))
    }

    /// [`Shader::light`].
    #[inline(always)]
    fn light<S: Simd>(&self, simd: S, normal: [Singles<S>; 3]) -> [Singles<S>; 2] {
        let key = at_least(simd, dot_with(simd, normal, self.shader.key), 0.0);
        let fill = at_least(simd, dot_with(simd, normal, self.shader.fill), 0.0);
        let key = key * KEY_STRENGTH;
        [key + AMBIENT + fill * FILL_STRENGTH, key]
    }
}
