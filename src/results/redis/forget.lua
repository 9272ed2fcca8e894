-- The beginning of each script that removes reports: keys, and functions that remove.
--
-- `cameras`: each camera with the ID of its latest report. `latest`: `ID:SIZE` of the latest report
-- of each camera. `earlier`: `ID:SIZE:CAMERA` of every other report, by ID. `totals`: the newest ID
-- (`last`), and the size of all reports (`bytes`). `images`: the cameras that have an image, with
-- the ID of its report. The content of a report is in a stream of its camera, under the same ID.
local earlier, cameras, latest, totals, images = unpack(KEYS)
local prefix_of_cameras, prefix_of_images, camera = unpack(ARGV, 1, 3)
-- The size of all reports that were removed.
local freed = 0

local function forget_image(name)
  if redis.call('ZREM', images, name) == 1 then
    redis.call('DEL', prefix_of_images .. name)
  end
end

-- Removes the report of an element that was removed from `earlier`.
local function forget(element)
  local micros, size, name = string.match(element, '^(%d+):(%d+):(.*)$')
  -- Another program may have overwritten the key.
  redis.pcall('XDEL', prefix_of_cameras .. name, micros .. '-0')
  freed = freed + size
end

-- Removes a camera, all of its reports and its image. Returns 1 if it had reports.
local function forget_camera(name)
  local stream = prefix_of_cameras .. name
  local entries = redis.pcall('XRANGE', stream, '-', '+')
  for _, entry in ipairs(entries) do
    local micros = string.match(entry[1], '^%d+')
    local element = redis.call('ZRANGEBYSCORE', earlier, micros, micros)[1]
    if element then
      redis.call('ZREM', earlier, element)
      freed = freed + string.match(element, '^%d+:(%d+)')
    end
  end
  local newest = redis.call('HGET', latest, name)
  if newest then
    redis.call('HDEL', latest, name)
    freed = freed + string.match(newest, '^%d+:(%d+)')
  end
  redis.call('ZREM', cameras, name)
  forget_image(name)
  return redis.call('DEL', stream)
end

