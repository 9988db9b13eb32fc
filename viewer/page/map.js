// The robot from above, and the way that it has come.

import { ofType } from "./colours.js";
import { boxes } from "./ground.js";

const MARGIN = 12;

export class Map {
    constructor(canvas, run) {
        Object.assign(this, { canvas, run, places: [] });
        this.measure();
    }

    /** Brings the way and the borders to what has come of the run. */
    measure() {
        const { run } = this;
        // The way of the first module, ten points a second at most.
        const points = Math.min(Math.ceil(run.seconds * 10) + 1, 600);
        this.way = Array.from({ length: points }, (_, index) =>
            run.place(0, (run.seconds * index) / Math.max(1, points - 1)),
        );
        const all = [...this.way];
        for (const time of [0, run.seconds / 2, run.seconds]) {
            for (let module = 0; module < run.modules; module++) all.push(run.place(module, time));
        }
        const [xs, ys] = [all.map(({ x }) => x), all.map(({ y }) => y)];
        const least = (list) => list.reduce((one, other) => Math.min(one, other), Infinity);
        const most = (list) => list.reduce((one, other) => Math.max(one, other), -Infinity);
        Object.assign(this, { left: least(xs), right: most(xs), low: least(ys), high: most(ys) });
    }

    draw(time, selected, theme) {
        const scale = Math.min(devicePixelRatio, 2);
        const [wide, high] = [this.canvas.clientWidth, this.canvas.clientHeight];
        if (!wide) return;
        [this.canvas.width, this.canvas.height] = [wide * scale, high * scale];
        const context = this.canvas.getContext("2d");
        context.scale(scale, scale);
        const [width, depth] = [Math.max(this.right - this.left, 0.3), Math.max(this.high - this.low, 0.15)];
        const unit = Math.min((wide - 2 * MARGIN) / width, (high - 2 * MARGIN) / depth);
        const [middle, across] = [(this.left + this.right) / 2, (this.low + this.high) / 2];
        const at = ({ x, y }) => [wide / 2 + (x - middle) * unit, high / 2 - (y - across) * unit];
        context.strokeStyle = context.fillStyle = theme.line;
        for (const {
            at: [x, y],
            size,
            turn,
        } of this.run.about.ground ? boxes(this.run.about.ground) : []) {
            context.save();
            context.translate(...at({ x, y }));
            context.rotate((-turn * Math.PI) / 180);
            context.globalAlpha = 0.35;
            context.fillRect((-size[0] * unit) / 2, (-size[1] * unit) / 2, size[0] * unit, size[1] * unit);
            context.restore();
        }
        context.strokeStyle = theme.path;
        context.globalAlpha = 0.6;
        context.beginPath();
        this.way.forEach((place) => context.lineTo(...at(place)));
        context.stroke();
        context.globalAlpha = 1;
        const radius = Math.min(Math.max(0.05 * unit, 1.6), 5);
        this.places = [];
        for (let module = 0; module < this.run.modules; module++) {
            const place = at(this.run.place(module, time));
            this.places.push(place);
            context.fillStyle = ofType(this.run.type(module, time));
            context.beginPath();
            context.arc(...place, module === selected ? radius + 3 : radius, 0, 2 * Math.PI);
            context.fill();
        }
    }

    /** The module nearest to a place of the map. */
    pick(x, y) {
        const far = ([its, others]) => Math.hypot(its - x, others - y);
        const near = this.places.reduce(
            (best, place, module) => (far(place) < far(this.places[best]) ? module : best),
            0,
        );
        return far(this.places[near]) < 24 ? near : null;
    }
}
