// jsPsych's two plugins of this study: `Rate` shows a screen with items, `Choose` one with cards to choose from.
//
// Both show what the server sent and hand what was answered to `deliver`, which resolves when the server has saved it;
// only then is the trial over.

import { show } from "./screen.js";

const { ParameterType } = globalThis.jsPsychModule;
const PARAMETERS = {
    screen: { type: ParameterType.OBJECT, default: undefined }, // as in the server's reply
    picture: { type: ParameterType.OBJECT, default: null }, // {address, text, width, height} of the map
    again: { type: ParameterType.STRING, default: null }, // said above: the screen comes once more, since something was wrong
    locked: { type: ParameterType.STRING, default: null }, // said in place of the form: this is to be looked at only
    deliver: { type: ParameterType.FUNCTION, default: undefined }, // values to a promise
    shown: { type: ParameterType.FUNCTION, default: undefined }, // called when everything can be seen
};

function plugin(name, cards) {
    return class {
        static info = { name, version: "1.0.0", parameters: PARAMETERS, data: { values: { type: ParameterType.OBJECT } } };

        constructor(jsPsych) {
            this.jsPsych = jsPsych;
        }

        trial(display, trial) {
            show(display, trial, cards, async (values) => {
                await trial.deliver(values);
                this.jsPsych.finishTrial({ values });
            });
            if (trial.picture) display.addEventListener("shown", () => trial.shown(), { once: true });
            else trial.shown();
        }
    };
}

export const Rate = plugin("ratherthan-rate", false);
export const Choose = plugin("ratherthan-choose", true);
