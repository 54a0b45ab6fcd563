//! The panel beside the scene: the fields, which can be edited while they act, the settings, and measurements.

use rapier_testbed3d::egui::{self, Context, DragValue, Slider, Ui};
use rapier3d_fields::debug_render::FieldDebugRenderStyle;
use rapier3d_fields::prelude::*;

use clap::ValueEnum;

use crate::drawing::{Part, paint};
use crate::session::Session;

/// The warnings of a step that are listed.
const LISTED: usize = 5;

pub fn show(context: &Context, session: &mut Session) {
    let window = egui::Window::new("Fields").default_pos([980.0, 12.0]);
    window
        .default_width(280.0)
        .vscroll(true)
        .show(context, |ui| {
            head(ui, session);
            section(ui, "Fields", true, |ui| {
                fields(ui, &mut session.scene.fields)
            });
            section(ui, "Step", true, |ui| step(ui, session));
            section(ui, "Drawing", true, |ui| drawing(ui, session));
            section(ui, "Energy", false, |ui| energy(ui, session));
            section(ui, "Cross-check", false, |ui| {
                cross_check(ui, &mut session.scene.fields)
            });
            section(ui, "Time of the stages", false, |ui| {
                ui.monospace(session.scene.fields.timings().to_string());
            });
            section(ui, "Plan", false, |ui| {
                ui.monospace(session.scene.fields.plan().to_string());
            });
        });
}

fn section(ui: &mut Ui, title: &str, is_open: bool, content: impl FnOnce(&mut Ui)) {
    let header = egui::CollapsingHeader::new(title).default_open(is_open);
    header.show(ui, content);
}

/// The description, the time, and whatever is wrong.
fn head(ui: &mut Ui, session: &Session) {
    ui.label(&session.about);
    let time = session.scene.fields.time();
    ui.label(format!("step {}, time {time:.2}", session.steps));
    for problem in [&session.refused_file, &session.refused_step]
        .into_iter()
        .flatten()
    {
        ui.colored_label(egui::Color32::RED, problem);
    }
    for warning in session.warnings.iter().take(LISTED) {
        ui.colored_label(egui::Color32::ORANGE, warning.to_string());
    }
    let more = session.warnings.len().saturating_sub(LISTED);
    if more > 0 {
        ui.label(format!("and {more} more warnings"));
    }
}

/// Each field with its colour, a switch and its strength.
fn fields(ui: &mut Ui, fields: &mut Fields) {
    let handles: Vec<FieldHandle> = fields.set.iter().map(|(handle, _)| handle).collect();
    for handle in handles {
        let name = fields.set.describe(handle).unwrap_or_default().to_string();
        let field = &fields[handle];
        let before = (field.enabled, field.strength);
        ui.horizontal(|ui| {
            let [red, green, blue, _] =
                <[f32; 4]>::from(paint(FieldDebugRenderStyle::field_color(handle)));
            let color = [red, green, blue].map(|share| (share * 255.0) as u8);
            ui.colored_label(egui::Color32::from_rgb(color[0], color[1], color[2]), "⬛");
            let (mut enabled, mut strength) = before;
            ui.checkbox(&mut enabled, name);
            ui.add(DragValue::new(&mut strength).speed(0.02).prefix("× "));
            // Only then, because whatever is borrowed to be changed is compiled again.
            if (enabled, strength) != before {
                let field = &mut fields[handle];
                (field.enabled, field.strength) = (enabled, strength);
            }
        });
    }
}

fn step(ui: &mut Ui, session: &mut Session) {
    let (fields, world) = (&mut session.scene.fields, &mut session.scene.world);
    let dt = &mut world.integration_parameters.dt;
    ui.add(
        Slider::new(dt, 1.0e-4..=0.1)
            .logarithmic(true)
            .text("time step"),
    );
    let scheme = &mut fields.settings.scheme;
    choose(
        ui,
        "scheme",
        scheme,
        &[
            Scheme::KickDriftKick,
            Scheme::Forward4,
            Scheme::auto(1e-3),
            Scheme::substeps(4),
            Scheme::LinearlyImplicit,
            Scheme::Kick,
            Scheme::ExternalForce,
        ],
    );
    let detection = &mut fields.settings.detection;
    choose(
        ui,
        "detection",
        detection,
        &[Detection::Discrete, Detection::Swept],
    );
    let mut responder = fields.settings.responder();
    let sides = [Responder::Rapier, Responder::Fields, Responder::Both];
    choose(ui, "contacts are answered by", &mut responder, &sides);
    fields.settings.set_responder(responder);
}

/// A list to choose one value from.
fn choose<T: Copy + PartialEq + std::fmt::Debug>(
    ui: &mut Ui,
    label: &str,
    value: &mut T,
    values: &[T],
) {
    let list = egui::ComboBox::from_label(label).selected_text(format!("{value:?}"));
    list.show_ui(ui, |ui| {
        for each in values {
            ui.selectable_value(value, *each, format!("{each:?}"));
        }
    });
}

fn drawing(ui: &mut Ui, session: &mut Session) {
    for part in Part::value_variants() {
        let mode = &mut session.drawing.mode;
        let mut is_on = mode.contains(part.flag());
        if ui.checkbox(&mut is_on, part.label()).changed() {
            if is_on {
                mode.insert(part.flag());
            } else {
                mode.remove(part.flag());
            }
        }
    }
    let points = &mut session.drawing.style.slice_points;
    ui.add(Slider::new(points, 3..=60).text("arrows along an edge"));
}

fn energy(ui: &mut Ui, session: &mut Session) {
    let energies = session.energies();
    ui.monospace(format!(
        "kinetic {:12.4}\nfields  {:12.4}\nsum     {:12.4}",
        energies.kinetic,
        energies.fields.total,
        energies.kinetic + energies.fields.total
    ));
    if energies.fields.without > 0 {
        ui.label(format!("{} without a potential", energies.fields.without));
    }
    let fields = &mut session.scene.fields;
    ui.checkbox(&mut fields.settings.audit, "audit of each field");
    if let Some(audit) = fields.audit() {
        ui.monospace(audit.to_string());
    }
}

fn cross_check(ui: &mut Ui, fields: &mut Fields) {
    let mut is_on = fields.cross_check().is_some();
    if ui
        .checkbox(&mut is_on, "compare with Rapier's contacts")
        .changed()
    {
        fields.settings.cross_check = is_on.into();
    }
    if let Some(report) = fields.cross_check() {
        ui.monospace(report.to_string());
    }
}
