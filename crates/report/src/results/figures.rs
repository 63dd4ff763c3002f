//! The document's pictures.

use crate::document::Section;
use crate::montage::{Panel, montage};
use crate::results::Drawn;
use screendoor_study::study::publications::{NamedPicture, Publications};
use screendoor_trace::picture::Picture;

/// A figure of the document: its file and what it is made of.
#[derive(Clone, Copy, Debug)]
pub struct Figure {
    /// The file's name, without its ending.
    pub file: &'static str,
    /// Names of its panels among the publications' pictures.
    pub panels: &'static [&'static str],
    /// Panels in a row.
    columns: u32,
    /// Magnification of each pixel.
    enlarge: u32,
    /// The panels' part that is shown, in sixteenths of their side: left, top,
    /// side; all of it where not given.
    part: Option<[u32; 3]>,
    caption: &'static str,
}

/// All figures.
pub const FIGURES: &[Figure] = &[
    Figure {
        file: "figure-8",
        panels: &["figure-8-enderton", "figure-8-lk", "figure-8-exact"],
        columns: 3,
        enlarge: 1,
        part: None,
        caption: "LK figure 8: smoke as billboards of alpha 0.05 at 16 samples, `enderton`, `lk` and \
                  `exact`.",
    },
    Figure {
        file: "figure-1",
        panels: &["figure-1-enderton", "figure-1-lk"],
        columns: 2,
        enlarge: 2,
        part: None,
        caption: "LK figure 1, left of each pair: `builtin:ramps` at 16 samples, `enderton` \
                  and `lk`. From the top: alpha from 0 to 1; alpha 0.61; alpha 0.75 drawn as five \
                  quads.",
    },
    Figure {
        file: "figure-1-cloth",
        panels: &["figure-1-cloth-enderton", "figure-1-cloth-lk"],
        columns: 2,
        enlarge: 3,
        part: None,
        caption: "LK figure 1, right of each pair: a detail of `builtin:cloth` at 64 samples, \
                  `enderton` and `lk`.",
    },
    Figure {
        file: "figure-3",
        panels: &[
            "figure-3-lk2011",
            "figure-3-sobol",
            "figure-3-white",
            "figure-3-lk2011-static",
            "figure-3-sobol-static",
            "figure-3-radical-inverse",
        ],
        columns: 3,
        enlarge: 2,
        part: None,
        caption: "LK figure 3: eight white layers of alpha 0.1 at 8 samples. Upper row, samples \
                  compacted and sorted: `lk2011`, `sobol`, `white`. Lower row, reference values \
                  fixed to samples as in section 3 of the paper (`sort=false,compact=false`): \
                  `lk2011`, `sobol`, `radical-inverse`.",
    },
    Figure {
        file: "figure-6",
        panels: &["figure-6-unsorted", "figure-6-sorted"],
        columns: 2,
        enlarge: 3,
        part: None,
        caption: "LK figure 6: a detail of `builtin:cloth`, triangles in random order, 16 \
                  samples, without and with the sort.",
    },
    Figure {
        file: "screen-doors",
        panels: &[
            "screen-door-exact",
            "screen-door-stipple",
            "screen-door-mask",
            "screen-door-points",
        ],
        columns: 4,
        enlarge: 2,
        part: None,
        caption: "Balls of alpha 0.5 blended exactly, and by the screen doors `stipple`, `mask` and \
                  `points`, averaged over 16 by 16 pixels. One stipple for all hides what is behind; \
                  points make silhouettes more opaque.",
    },
    Figure {
        file: "figure-9",
        panels: &["figure-9-enderton", "figure-9-lk"],
        columns: 2,
        enlarge: 1,
        part: Some([4, 4, 8]),
        caption: "LK figure 9: a detail of `builtin:engine`, white, alpha 0.3, 16 samples, \
                  `enderton` and `lk`.",
    },
    Figure {
        file: "figure-10",
        panels: &["figure-10-enderton", "figure-10-lk"],
        columns: 2,
        enlarge: 1,
        part: Some([4, 4, 8]),
        caption: "LK figure 10: a detail of `builtin:cloth`, alpha 0.4, 16 samples, `enderton` \
                  and `lk`.",
    },
];

/// The file of the picture of all built-in scenes.
const GALLERY: &str = "scenes";

/// The document's figures: file names and pictures.
pub(super) fn figures(publications: &Publications) -> Vec<(&'static str, Drawn)> {
    let scenes: Vec<Panel<'_>> = publications
        .gallery
        .iter()
        .map(|(_, picture)| Panel { picture, crop: None, enlarge: 1 })
        .collect();
    let mut list = Vec::new();
    if !scenes.is_empty() {
        list.push((GALLERY, Drawn::Picture(montage(&scenes, 4))));
    }
    list.extend(of(&publications.pictures));
    list
}

/// The figures that can be made of `pictures`.
pub(super) fn of(pictures: &[NamedPicture]) -> Vec<(&'static str, Drawn)> {
    let find = |name: &str| pictures.iter().find(|(n, _)| *n == name);
    FIGURES
        .iter()
        .filter_map(|figure| {
            let pictures: Option<Vec<&Picture>> =
                figure.panels.iter().map(|n| find(n).map(|(_, p)| p)).collect();
            let panel = |picture| {
                let crop = figure.part.map(|part| {
                    let side = Picture::width(picture);
                    let [left, top, size] = part.map(|p| p * side / 16);
                    [left, top, size, size]
                });
                Panel { picture, crop, enlarge: figure.enlarge }
            };
            let panels: Vec<Panel<'_>> = pictures?.into_iter().map(panel).collect();
            Some((figure.file, Drawn::Picture(montage(&panels, figure.columns))))
        })
        .collect()
}

/// The built-in scenes and the figures that belong to no other section.
pub(super) fn section(p: &Publications) -> Option<Section> {
    if p.gallery.is_empty() {
        return None;
    }
    let scenes: Vec<&str> = p.gallery.iter().map(|(name, _)| name.as_str()).collect();
    let caption = format!("The built-in scenes, composited exactly: {}.", scenes.join(", "));
    let mut section = Section::new("Pictures");
    section.figure(format!("{GALLERY}.png"), "The built-in scenes", caption);
    show(&mut section, &p.pictures, &["figure-9", "figure-10"]);
    Some(section)
}

/// Shows those of the figures whose files are `wanted` that can be made of `pictures`.
pub(super) fn show(section: &mut Section, pictures: &[NamedPicture], wanted: &[&str]) {
    let there = |name: &&str| pictures.iter().any(|(n, _)| n == name);
    for figure in FIGURES.iter().filter(|f| wanted.contains(&f.file) && f.panels.iter().all(there))
    {
        // The caption's first sentence is what stands for the picture.
        let what = figure.caption.split(". ").next().unwrap_or(figure.file).replace('`', "");
        section.figure(format!("{}.png", figure.file), what, figure.caption);
    }
}
