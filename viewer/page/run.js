// What a run was like at any time, as far as it has come.

import { Matrix4, Quaternion, Vector3 } from "three";

const NUMBERS = 10;
/** So many are kept: 40 s. */
const MOST_INSIDES = 1000;

/** How many of `list`, which is in the order of `at`, are not later than `time`. */
export function until(list, time, at = (item) => item.at) {
    let [low, high] = [0, list.length];
    while (low < high) {
        const middle = (low + high) >> 1;
        if (at(list[middle]) <= time) low = middle + 1;
        else high = middle;
    }
    return low;
}

/** Puts an item into `list`, which is in the order of `at`: most come last. */
function insert(list, item, at = (item) => item.at) {
    let place = list.length;
    while (place > 0 && at(list[place - 1]) > at(item)) place--;
    list.splice(place, 0, item);
}

const sentAt = ({ sent }) => sent;
const arrivedAt = ({ arrived }) => arrived;

export class Run {
    /** A run of which nothing has come yet. */
    constructor(about) {
        const byModule = () => Array.from({ length: about.modules }, () => []);
        Object.assign(this, {
            about,
            modules: about.modules,
            looks: 0,
            placings: new Float32Array(0),
            hormones: [],
            deliveries: [],
            losses: [],
            countsLosses: false,
            wirings: [],
            happenings: [],
            actions: byModule(),
            madeGood: byModule(),
            generated: byModule(),
            views: byModule(),
            leaving: byModule(),
            arriving: byModule(),
            longest: 0,
            insides: [],
        });
        this.deeds = { action: this.actions, "made good": this.madeGood, generated: this.generated };
    }

    /** How much of it has come, in s. */
    get seconds() {
        return Math.max(0, (this.looks - 1) * this.about.every);
    }

    /** Takes what has come of it since, in words and unpacked. */
    append(part, { placings, hormones, deeds, views, losses }) {
        this.keep(placings, part.looks);
        for (const { seconds, pairs } of part.wirings) this.wirings.push(this.wired(seconds, pairs));
        this.happenings.push(...part.happenings);
        for (const deed of deeds) this.deeds[deed.what]?.[deed.module].push(deed);
        for (const view of views) this.views[view.module].push(view);
        for (const loss of losses) this.losses.push(loss);
        this.countsLosses ||= part.counts_losses;
        for (const passage of hormones) this.pass(passage);
    }

    keep(placings, looks) {
        const [had, numbers] = [this.looks * this.modules * NUMBERS, placings.length];
        if (had + numbers > this.placings.length) {
            const room = new Float32Array(Math.max(had + numbers, had ? 2 * this.placings.length : 0));
            room.set(this.placings.subarray(0, had));
            this.placings = room;
        }
        this.placings.set(placings, had);
        this.looks += looks;
    }

    wired(at, pairs) {
        const peers = Array.from({ length: this.modules }, () => Array(6).fill(null));
        for (const [one, its, other, others] of pairs) {
            peers[one][its] = { module: other, dock: others };
            peers[other][others] = { module: one, dock: its };
        }
        return { at, pairs, peers };
    }

    pass(passage) {
        const { from, sent, arrived } = passage;
        // What was sent just before the end may have been on its way.
        passage.isLost = arrived === null && sent + this.about.lost_after < this.about.seconds;
        passage.to = this.wiring(sent).peers[from.module][from.dock];
        insert(this.hormones, passage, sentAt);
        insert(this.leaving[from.module], passage, sentAt);
        this.longest = Math.max(this.longest, (arrived ?? sent) - sent);
        if (arrived === null) return;
        insert(this.deliveries, arrived, (at) => at);
        if (passage.to) insert(this.arriving[passage.to.module], passage, arrivedAt);
    }

    /** Takes what there was to see inside of a module. */
    tell(inside) {
        this.insides.push(inside);
        if (this.insides.length > MOST_INSIDES) this.insides.shift();
    }

    /** What there was to see inside of a module, if anybody looked about then: before, or else a little
     * later, for the page is behind the run. */
    inside(module, time) {
        const place = until(this.insides, time + this.about.every / 2);
        const near = this.insides.slice(Math.max(0, place - 1), place + 1);
        return near.find((inside) => inside.module === module && Math.abs(time - inside.at) < 1) ?? null;
    }

    wiring(time) {
        return this.wirings[Math.max(0, until(this.wirings, time) - 1)];
    }

    last(lists, module, time) {
        const list = lists[module];
        return list[until(list, time) - 1];
    }

    type(module, time) {
        return this.last(this.views, module, time)?.type ?? "Starting";
    }

    /** Whether it has power, and has begun. */
    runs(module, time) {
        return this.type(module, time) !== "Starting";
    }

    action(module, time) {
        return this.last(this.actions, module, time)?.of ?? "none yet";
    }

    /** The docks at which a module has found a neighbour, as bits. */
    known(module, time) {
        return this.last(this.views, module, time)?.docks ?? 0;
    }

    /** The last hormone that a module took up. */
    arrived(module, time) {
        const list = this.arriving[module];
        return list[until(list, time, (passage) => passage.arrived) - 1];
    }

    /** How many hormones a module has got and sent on. */
    counts(module, time) {
        return {
            received: until(this.arriving[module], time, (passage) => passage.arrived),
            sent: until(this.leaving[module], time, (passage) => passage.sent),
            madeGood: until(this.madeGood[module], time),
        };
    }

    /** The hormones that are on their way, or were within so many seconds. */
    underWay(time, linger) {
        const first = until(
            this.hormones,
            time - linger - Math.min(this.longest, 0.5),
            (passage) => passage.sent,
        );
        const end = until(this.hormones, time, (passage) => passage.sent);
        const lasts = ({ sent, arrived }) => (arrived ?? sent) + linger >= time;
        return this.hormones.slice(first, end).filter(lasts);
    }

    /** The frames that links lost within so many seconds. */
    lost(time, linger) {
        return this.losses.slice(until(this.losses, time - linger), until(this.losses, time));
    }

    /** Where a module is at a time: between two looks, by their mean. */
    placing(module, time, into = { frame: new Matrix4(), angles: [0, 0, 0] }) {
        const { placings, modules, about } = this;
        const exact = Math.min(Math.max(time / about.every, 0), this.looks - 1);
        const look = Math.floor(exact);
        const share = exact - look;
        const one = (look * modules + module) * NUMBERS;
        const other = (Math.min(look + 1, this.looks - 1) * modules + module) * NUMBERS;
        const mean = (index) => placings[one + index] * (1 - share) + placings[other + index] * share;
        AT.set(mean(0), mean(1), mean(2));
        FROM.fromArray(placings, one + 3).normalize();
        TO.fromArray(placings, other + 3).normalize();
        into.frame.compose(AT, FROM.slerp(TO, share), ONE);
        for (let joint = 0; joint < 3; joint++) into.angles[joint] = mean(7 + joint);
        return into;
    }

    /** Where a module has its middle. */
    place(module, time) {
        return new Vector3().setFromMatrixPosition(this.placing(module, time).frame);
    }
}

const [AT, ONE] = [new Vector3(), new Vector3(1, 1, 1)];
const [FROM, TO] = [new Quaternion(), new Quaternion()];
