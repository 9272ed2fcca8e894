/** Every test that needs a server, one after the other in one browser. */

import "./agreement.js";
import "./detect.js";
import "./sections.js";
import "./calibrate.js";
import "./find_lens.js";
import "./zones.js";
import "./looks.js";
import "./counts.js";
import "./cameras.js";
import "./floor_alerts.js";
