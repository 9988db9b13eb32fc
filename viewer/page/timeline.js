// The band over the time: each line is a module, bright while it moves; above, what happened.

import { isBright, ofType } from "./colours.js";
import { until } from "./run.js";

const HAPPENINGS = 8;

/** Draws the band, as wide and as high as it is on the page. */
export function drawBand(canvas, run, theme) {
    const scale = Math.min(devicePixelRatio, 2);
    const width = (canvas.width = Math.max(1, Math.round(canvas.clientWidth * scale)));
    const height = (canvas.height = Math.max(1, Math.round(canvas.clientHeight * scale)));
    const context = canvas.getContext("2d");
    const top = HAPPENINGS * scale;
    const line = (height - top) / run.modules;
    const x = (time) => (run.seconds ? (time / run.seconds) * width : 0);
    context.fillStyle = theme.still;
    context.fillRect(0, top, width, height - top);
    for (let module = 0; module < run.modules; module++) {
        const actions = run.actions[module];
        actions.forEach(({ at, of }, index) => {
            if (!isBright(of)) return;
            context.fillStyle = ofType(run.type(module, at));
            const end = actions[index + 1]?.at ?? run.seconds;
            context.fillRect(
                x(at),
                top + module * line,
                Math.max(1, x(end) - x(at)),
                Math.max(1, line - (line > 3 ? 1 : 0)),
            );
        });
    }
    context.fillStyle = theme.lost;
    for (const { at, from } of run.losses) {
        context.fillRect(x(at), top + from.module * line, Math.max(1, scale), Math.max(1, line));
    }
    context.fillStyle = theme.text;
    for (const [seconds] of run.happenings) {
        context.beginPath();
        context.moveTo(x(seconds) - 4 * scale, 0);
        context.lineTo(x(seconds) + 4 * scale, 0);
        context.lineTo(x(seconds), top - scale);
        context.fill();
    }
    return context.getImageData(0, 0, width, height);
}

/** Puts the time into the band. */
export function drawTime(canvas, band, run, time, theme) {
    const context = canvas.getContext("2d");
    context.putImageData(band, 0, 0);
    const x = run.seconds ? (time / run.seconds) * canvas.width : 0;
    const scale = canvas.width / Math.max(1, canvas.clientWidth);
    context.fillStyle = theme.path;
    context.fillRect(Math.min(x, canvas.width - 2 * scale), 0, 2 * scale, canvas.height);
    context.globalAlpha = 0.12;
    context.fillRect(0, 0, x, canvas.height);
    context.globalAlpha = 1;
}

/** The last thing that happened, in words, while it is fresh. */
export function happened(run, time, lasts = 2) {
    const { happenings } = run;
    const last = happenings[until(happenings, time, ([seconds]) => seconds) - 1];
    return last && time - last[0] < lasts ? last[1] : "";
}
