-- Stores a report and evicts what exceeds the limits, in one atomic step.
--
-- `reports`: a stream of all kept reports, with the camera and the size of each. `earlier`: the IDs
-- of those that are not their camera's latest. `cameras`: each camera with the ID of its latest
-- report. `totals`: the newest ID, and the size of all reports in bytes. `pictures`: the cameras
-- that have an image, with the ID of its report. `sender`: the number of the last report that this
-- server sent. The content of a report is in a stream of its camera, under the same ID.
local reports, earlier, cameras, totals, pictures, sender = unpack(KEYS)
local prefix_of_cameras, prefix_of_pictures, number = unpack(ARGV, 1, 3)
local camera, received_at, persons, json, frame, sketch, bytes = unpack(ARGV, 4, 10)
local most_cameras, most_of_camera = tonumber(ARGV[11]), tonumber(ARGV[12])
local most_reports, most_bytes = tonumber(ARGV[13]), tonumber(ARGV[14])
local most_pictures, max_age_seconds = tonumber(ARGV[15]), tonumber(ARGV[16])
-- Most expired reports that one call removes.
local OLD_AT_A_TIME = 100

-- The report was stored before, but the answer was lost.
if redis.call('GET', sender) == number then
  return
end

-- Redis may have evicted one of the two keys: start with an empty store then.
if redis.call('EXISTS', reports, totals) < 2 then
  redis.call('DEL', reports, earlier, cameras)
  redis.call('HSET', totals, 'bytes', 0)
end

local function forget_picture(name)
  redis.call('DEL', prefix_of_pictures .. name)
  redis.call('ZREM', pictures, name)
end

local function forget(id)
  local entry = redis.call('XRANGE', reports, id, id)[1]
  if not entry then
    return
  end
  local name, size = entry[2][2], entry[2][4]
  local stream = prefix_of_cameras .. name
  redis.call('XDEL', reports, id)
  redis.call('ZREM', earlier, id)
  redis.call('HINCRBY', totals, 'bytes', -size)
  redis.call('XDEL', stream, id)
  if redis.call('XLEN', stream) == 0 then
    redis.call('DEL', stream)
    redis.call('ZREM', cameras, name)
    forget_picture(name)
  end
end

local time = redis.call('TIME')
local now = time[1] * 1000000 + time[2]
local last = tonumber(redis.call('HGET', totals, 'last') or 0)
local micros = string.format('%.0f', math.max(now, last + 1))
local id = micros .. '-0'
local stream = prefix_of_cameras .. camera

local before = redis.call('XREVRANGE', stream, '+', '-', 'COUNT', 1)[1]
if before then
  redis.call('ZADD', earlier, string.match(before[1], '%d+'), before[1])
end
redis.call('XADD', stream, id, 'received_at', received_at, 'persons', persons, 'json', json)
redis.call('XADD', reports, id, 'camera', camera, 'bytes', bytes)
redis.call('ZADD', cameras, micros, camera)
redis.call('HSET', totals, 'last', micros)
redis.call('HINCRBY', totals, 'bytes', bytes)
-- The image is that of the latest report. A report without an image removes it.
forget_picture(camera)
if frame ~= '' then
  redis.call('HSET', prefix_of_pictures .. camera, 'id', micros, 'frame', frame, 'sketch', sketch)
  redis.call('EXPIRE', prefix_of_pictures .. camera, max_age_seconds)
  redis.call('ZADD', pictures, micros, camera)
end
redis.call('SET', sender, number, 'EX', max_age_seconds)

local oldest = string.format('%.0f', now - max_age_seconds * 1000000)
for _, old in ipairs(redis.call('XRANGE', reports, '-', oldest, 'COUNT', OLD_AT_A_TIME)) do
  forget(old[1])
end
while redis.call('XLEN', stream) > most_of_camera do
  local first = redis.call('XRANGE', stream, '-', '+', 'COUNT', 1)[1][1]
  forget(first)
  redis.call('XDEL', stream, first)
end
while redis.call('ZCARD', cameras) > most_cameras do
  local silent = redis.call('ZRANGE', cameras, 0, 0)[1]
  for _, entry in ipairs(redis.call('XRANGE', prefix_of_cameras .. silent, '-', '+')) do
    forget(entry[1])
  end
  redis.call('ZREM', cameras, silent)
end

local function too_many()
  local count = redis.call('XLEN', reports)
  local size = tonumber(redis.call('HGET', totals, 'bytes'))
  return count > most_reports or (count > 0 and size > most_bytes)
end

while too_many() do
  local first = redis.call('ZPOPMIN', earlier)[1]
  if not first then
    -- All remaining reports are their cameras' latest, in order.
    first = redis.call('XRANGE', reports, '-', '+', 'COUNT', 1)[1][1]
  end
  forget(first)
end

redis.call('ZREMRANGEBYSCORE', pictures, '-inf', oldest)
while redis.call('ZCARD', pictures) > most_pictures do
  forget_picture(redis.call('ZRANGE', pictures, 0, 0)[1])
end

for _, key in ipairs({reports, earlier, cameras, totals, pictures, stream}) do
  redis.call('EXPIRE', key, max_age_seconds)
end
