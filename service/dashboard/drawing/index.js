// The 3D view, in parts: one file a thing that is drawn with.

export { loadLoss } from "./heat_map.js";
export { Stage } from "./stage.js";
